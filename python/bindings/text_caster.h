// Strings as Python's os functions have them: names of files need not be UTF-8, and str holds such bytes as surrogates. Takes the place of
// nanobind/stl/string.h, which refuses them with a TypeError.
#pragma once

#include <nanobind/nanobind.h>

#include <string>

namespace nanobind::detail {

template <>
struct type_caster<std::string> {
  NB_TYPE_CASTER(std::string, const_name("str"))

  template <typename Flags>  // of another type in each release of nanobind
  bool from_python(handle source, Flags, cleanup_list*) noexcept {
    if (!PyUnicode_Check(source.ptr())) return false;
    PyObject* bytes = PyUnicode_EncodeFSDefault(source.ptr());
    if (bytes == nullptr) {
      PyErr_Clear();
      return false;
    }
    value.assign(PyBytes_AsString(bytes), static_cast<std::size_t>(PyBytes_Size(bytes)));
    Py_DECREF(bytes);
    return value.find('\0') == std::string::npos;  // the system would take what stands before it for the file's name
  }

  static handle from_cpp(const std::string& text, rv_policy, cleanup_list*) noexcept {
    return PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<Py_ssize_t>(text.size()));
  }
};

}  // namespace nanobind::detail

#include "python/bindings/module.h"

#include <cerrno>
#include <filesystem>
#include <new>
#include <string>
#include <system_error>

#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace nb = nanobind;

namespace phimvs_python {
namespace {

// The class of phimvs/errors.py for an error, raised with its message.
void Raise(const char* class_name, const phi::Message& message) {
  const nb::object type = nb::module_::import_("phimvs.errors").attr(class_name);
  PyErr_SetObject(type.ptr(), type(*TupleOf(message)).ptr());
}

const char* ClassOf(phi::ExitCode code) {
  switch (code) {
    case phi::ExitCode::kUsage:
      return "UsageError";
    case phi::ExitCode::kOutOfResources:
      return "ResourceError";
    case phi::ExitCode::kNoDevice:
      return "NoDeviceError";
    default:
      return "InputError";
  }
}

const char* ClassOf(const std::system_error& error) {
  const int code = error.code().value();
  const bool is_out_of_resources =
      code == ENOSPC || code == EDQUOT || code == ENOMEM || code == EMFILE || code == ENFILE || code == EAGAIN;
  return is_out_of_resources ? "ResourceError" : "InputError";
}

void Translate(const std::exception_ptr& pointer, void*) {
  try {
    std::rethrow_exception(pointer);
  } catch (const phi::Cancelled&) {
    Raise("Cancelled", "cancelled; finished maps are kept, and the same call goes on where this one stopped");
  } catch (const phi::Error& error) {
    Raise(ClassOf(error.code()), error.message());
  } catch (const std::bad_alloc&) {
    Raise("ResourceError", "out of memory; lower PatchMatchStereo.cache_size or PatchMatchStereo.max_image_size");
  } catch (const std::filesystem::filesystem_error& error) {
    Raise(ClassOf(error), WithContext(error.what(), phi::AboutFile(error.path1())));
  } catch (const std::system_error& error) {
    Raise(ClassOf(error), error.what());
  }
}

}  // namespace

nb::str TextOf(const std::string& text) {
  PyObject* decoded = PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<Py_ssize_t>(text.size()));
  if (decoded == nullptr) nb::raise_python_error();
  return nb::steal<nb::str>(decoded);
}

nb::tuple TupleOf(const phi::Message& message) {
  return nb::make_tuple(TextOf(message.text), TextOf(message.file), TextOf(message.image), TextOf(message.stage));
}

}  // namespace phimvs_python

NB_MODULE(_core, module) {
  module.doc() = "The compiled part of phimvs; see the package's own functions.";
  module.attr("__version__") = PHIMVS_VERSION;
  nb::register_exception_translator(phimvs_python::Translate);
  phimvs_python::BindScene(module);
  phimvs_python::BindArrays(module);
  phimvs_python::BindCloudFile(module);
  phimvs_python::BindCommands(module);
  phimvs_python::BindMaps(module);
}

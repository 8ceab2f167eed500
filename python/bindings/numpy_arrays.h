// numpy arrays in and out.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace phimvs_python {

// In: contiguous, on the CPU, and not written to.
template <typename T, typename... Shape>
using Input = nanobind::ndarray<const T, nanobind::c_contig, nanobind::device::cpu, Shape...>;

// Out: contiguous and writable, with memory of its own.
template <typename T>
using Output = nanobind::ndarray<nanobind::numpy, T>;

template <typename T>
Output<T> MakeOutput(std::vector<T> values, std::vector<std::size_t> shape) {
  auto* owned = new std::vector<T>(std::move(values));
  const nanobind::capsule owner(owned, [](void* memory) noexcept { delete static_cast<std::vector<T>*>(memory); });
  return Output<T>(owned->data(), shape.size(), shape.data(), owner);
}

}  // namespace phimvs_python

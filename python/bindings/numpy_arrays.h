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

template <typename T, typename Allocator>
Output<T> MakeOutput(std::vector<T, Allocator> values, std::vector<std::size_t> shape) {
  using Values = std::vector<T, Allocator>;
  auto* owned = new Values(std::move(values));
  const nanobind::capsule owner(owned, [](void* memory) noexcept { delete static_cast<Values*>(memory); });
  return Output<T>(owned->data(), shape.size(), shape.data(), owner);
}

}  // namespace phimvs_python

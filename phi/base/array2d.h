// Owning 2-D array and its trivially copyable view. Index (x, y) = (column, row); row-major without padding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "phi/base/array_memory.h"
#include "phi/base/hd.h"

namespace phi {

template <typename T>
struct ArrayView2D {
  T* data = nullptr;
  int width = 0;
  int height = 0;

  PHI_HD T& operator()(int x, int y) const { return data[static_cast<std::int64_t>(y) * width + x]; }
  PHI_HD bool Contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  PHI_HD std::int64_t size() const { return static_cast<std::int64_t>(width) * height; }
  PHI_HD operator ArrayView2D<const T>() const { return {data, width, height}; }
};

template <typename T>
class Array2D {
 public:
  Array2D() = default;
  Array2D(int width, int height, const T& value = T())
      : width_(width), height_(height), data_(static_cast<std::size_t>(width) * height, value) {}

  // Without a value, and without a first touch of the memory: for arrays that will be written whole.
  static Array2D Uninitialized(int width, int height) {
    static_assert(std::is_trivially_copyable_v<T>);
    Array2D array;
    array.width_ = width;
    array.height_ = height;
    array.data_ = std::vector<T, ArrayAllocator<T>>(static_cast<std::size_t>(width) * height);
    return array;
  }

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return data_.empty(); }
  std::size_t size() const { return data_.size(); }
  std::size_t bytes() const { return data_.size() * sizeof(T); }

  T& operator()(int x, int y) { return data_[static_cast<std::size_t>(y) * width_ + x]; }
  const T& operator()(int x, int y) const { return data_[static_cast<std::size_t>(y) * width_ + x]; }
  T* data() { return data_.data(); }
  const T* data() const { return data_.data(); }
  T* begin() { return data_.data(); }
  T* end() { return data_.data() + data_.size(); }
  const T* begin() const { return data_.data(); }
  const T* end() const { return data_.data() + data_.size(); }

  ArrayView2D<T> view() { return {data_.data(), width_, height_}; }
  ArrayView2D<const T> view() const { return {data_.data(), width_, height_}; }

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<T, ArrayAllocator<T>> data_;
};

}  // namespace phi

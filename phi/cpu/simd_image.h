// A gray image laid out for one gather per bilinear sample: each element holds the 2 x 2 pixels that the
// sample needs.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/base/array_memory.h"
#include "phi/base/images.h"

namespace phi {

// Element (x, y) holds, from the lowest byte up, the pixels (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1),
// clamped to the image. A border of kBorder elements continues the image, so that rounding beyond its edge
// reads what lies there.
class PackedImage {
 public:
  static constexpr int kBorder = 2;

  explicit PackedImage(const GrayImage& image);

  int width() const { return width_; }
  int height() const { return height_; }
  std::int64_t stride() const { return width_ + 2 * kBorder; }
  // Element (0, 0); (x, y) is at y * stride() + x.
  const std::uint32_t* origin() const { return data_.data() + kBorder * stride() + kBorder; }

 private:
  int width_, height_;
  // Windows of wild hypotheses lie far apart.
  std::vector<std::uint32_t, ArrayAllocator<std::uint32_t, kLargeRandomArray>> data_;
};

}  // namespace phi

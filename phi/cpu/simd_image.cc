#include "phi/cpu/simd_image.h"

#include <algorithm>

namespace phi {

PackedImage::PackedImage(const GrayImage& image)
    : width_(image.width()),
      height_(image.height()),
      data_(static_cast<std::size_t>(stride()) * (image.height() + 2 * kBorder)) {
  const auto row = [&](int y) {
    return image.data() + static_cast<std::int64_t>(std::clamp(y, 0, height_ - 1)) * width_;
  };
  std::uint32_t* out = data_.data();
  for (int y = -kBorder; y < height_ + kBorder; ++y) {
    const std::uint8_t *upper = row(y), *lower = row(y + 1);
    for (int x = -kBorder; x < width_ + kBorder; ++x) {
      const int left = std::clamp(x, 0, width_ - 1), right = std::clamp(x + 1, 0, width_ - 1);
      *out++ = upper[left] | upper[right] << 8 | lower[left] << 16 |
               static_cast<std::uint32_t>(lower[right]) << 24;
    }
  }
}

}  // namespace phi

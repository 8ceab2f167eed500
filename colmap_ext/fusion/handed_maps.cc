#include "colmap_ext/fusion/handed_maps.h"

#include <algorithm>

namespace colmap_ext {

std::int64_t HandedImage::bytes() const {
  return static_cast<std::int64_t>((map != nullptr ? map->bytes() : 0) + (photo != nullptr ? photo->bytes.size() : 0));
}

int HandedMaps::num_maps() const {
  return static_cast<int>(
      std::count_if(images_.begin(), images_.end(), [](const HandedImage& image) { return image.map != nullptr; }));
}

std::int64_t HandedMaps::bytes() const {
  std::int64_t sum = 0;
  for (const HandedImage& image : images_) sum += image.bytes();
  return sum;
}

void HandedMaps::Trim(std::int64_t budget_bytes) {
  std::int64_t num_bytes = bytes();
  for (auto image = images_.rbegin(); image != images_.rend() && num_bytes > budget_bytes; ++image) {
    num_bytes -= image->bytes();
    *image = {};
  }
}

}  // namespace colmap_ext

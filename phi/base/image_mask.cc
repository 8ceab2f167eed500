#include "phi/base/image_mask.h"

#include <cstdint>
#include <limits>

#include "phi/base/whole_array.h"

namespace phi {
namespace {

constexpr int kFar = std::numeric_limits<int>::max() / 2;

// Brightness and distance (steps to the side, up or down) of the nearest used pixel found so far.
struct Nearest {
  int distance = kFar;
  std::uint8_t value = 0;

  void Take(const Nearest& neighbour) {
    if (neighbour.distance + 1 < distance) *this = {neighbour.distance + 1, neighbour.value};
  }
};

template <typename T>
void ClearMasked(const ImageMask& mask, Array2D<T>* map) {
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (mask.data()[i] == 0) map->data()[i] = {};
    }
  });
}

}  // namespace

// Two sweeps, which find a nearest used pixel by steps to the side, up and down.
Array2D<std::uint8_t> ExtendIntoMask(const Array2D<std::uint8_t>& image, const ImageMask& mask) {
  const int width = image.width(), height = image.height();
  Array2D<Nearest> nearest(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Nearest& here = nearest(x, y);
      if (mask(x, y) != 0) here = {0, image(x, y)};
      if (x > 0) here.Take(nearest(x - 1, y));
      if (y > 0) here.Take(nearest(x, y - 1));
    }
  }
  Array2D<std::uint8_t> extended(width, height);
  for (int y = height - 1; y >= 0; --y) {
    for (int x = width - 1; x >= 0; --x) {
      Nearest& here = nearest(x, y);
      if (x + 1 < width) here.Take(nearest(x + 1, y));
      if (y + 1 < height) here.Take(nearest(x, y + 1));
      extended(x, y) = here.value;
    }
  }
  return extended;
}

Array2D<std::uint8_t> CutOutMask(const Array2D<std::uint8_t>& image, const ImageMask& mask) {
  constexpr int kMiddle = 128;
  Array2D<std::uint8_t> cut = ExtendIntoMask(image, mask);
  for (std::size_t i = 0; i < cut.size(); ++i) {
    if (mask.data()[i] == 0) cut.data()[i] = cut.data()[i] < kMiddle ? 255 : 0;
  }
  return cut;
}

void DropMasked(const ImageMask& mask, PlaneMap* map) { ClearMasked(mask, map); }
void DropMasked(const ImageMask& mask, DepthMap* depths) { ClearMasked(mask, depths); }
void DropMasked(const ImageMask& mask, ImageMask* marks) { ClearMasked(mask, marks); }

}  // namespace phi

#include "phi/base/image_mask.h"

#include <cstdint>
#include <limits>

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

}  // namespace

// Two sweeps, which find a nearest used pixel by steps to the side, up and down.
GrayImage ExtendIntoMask(const GrayImage& image, const ImageMask& mask) {
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
  GrayImage extended(width, height);
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

GrayImage CutOutMask(const GrayImage& extended, const ImageMask& mask) {
  constexpr std::uint8_t kMiddle = 128;
  GrayImage cut(extended.width(), extended.height());
  for (std::size_t i = 0; i < cut.size(); ++i) {
    const std::uint8_t value = extended.data()[i];
    cut.data()[i] = mask.data()[i] != 0 ? value : value < kMiddle ? 255 : 0;
  }
  return cut;
}

}  // namespace phi

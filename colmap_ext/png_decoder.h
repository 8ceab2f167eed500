// PNG photos and masks by libpng itself: OpenCV, which decodes the others, gives it no functions for errors and warnings, and it
// prints them on stderr without the file's name, also those of odd colour profiles, which cost no pixel.
#pragma once

#include <cstdint>
#include <span>

#include "colmap_ext/image_file.h"

namespace colmap_ext {

bool IsPng(std::span<const std::uint8_t> bytes);

// Of a PNG, as its header tells.
struct PngPixels {
  int bits = 0;  // of a channel
  bool is_gray = false;
};
PngPixels PngPixelsOf(std::span<const std::uint8_t> bytes);

// The same bytes as OpenCV's: of 16 bits the upper ones, without alpha, gray by libpng's weights. Throw as DecodeGray and DecodeColor.
phi::GrayImage DecodePngGray(const PhotoFile& photo, const CheckSize& check_size);
ColorImage DecodePngColor(const PhotoFile& photo, const CheckSize& check_size);
// All bits of one that has 16.
phi::Array2D<std::uint16_t> DecodePngGray16(const PhotoFile& photo, const CheckSize& check_size);

}  // namespace colmap_ext

// Images as phimvs sees them: 8-bit gray or RGB of the file's stored pixels (an orientation tag is ignored,
// as COLMAP's cameras describe the stored pixels), whatever the file's depth and channels.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

#include "phi/backend.h"

namespace colmap_ext {

using Rgb = std::array<std::uint8_t, 3>;
using ColorImage = phi::Array2D<Rgb>;

// Throw phi::InputError naming the file when it is missing, damaged, cut short or of no known format.
phi::GrayImage ReadGrayImage(const std::filesystem::path& path);
ColorImage ReadColorImage(const std::filesystem::path& path);

// Area average where it shrinks, bilinear where it grows.
phi::GrayImage Resize(const phi::GrayImage& image, int width, int height);
ColorImage Resize(const ColorImage& image, int width, int height);

// The format follows from the name's extension; JPEG at `jpeg_quality` percent.
void WriteGrayImage(const std::filesystem::path& path, const phi::GrayImage& image, int jpeg_quality = 95);
void WriteColorImage(const std::filesystem::path& path, const ColorImage& image, int jpeg_quality = 95);

}  // namespace colmap_ext

// What a camera makes of radiance: exposure, noise, 8 bits, and the file's compression.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "colmap_ext/image_file.h"
#include "colmap_ext/synthetic/solid_texture.h"
#include "phi/base/images.h"
#include "phi/base/random.h"

namespace colmap_ext {

struct SensorOptions {
  double gain = 1;  // exposure
  double noise_sigma =
      0;  // grey levels; the same draw for red, green and blue, so that it is the grey image's sigma
  phi::RandomKey key;
};

ColorImage Develop(const phi::Array2D<Radiance>& radiance, const SensorOptions& options);

// Rec. 601 luma, rounded.
phi::GrayImage ToGray(const ColorImage& image);

// The bytes of a JPEG file; quality 0 stands for PNG.
std::vector<std::uint8_t> EncodeImage(const ColorImage& image, int jpeg_quality);
phi::GrayImage DecodeGray(const std::vector<std::uint8_t>& file);

// Two independent standard normal draws, a function of (key, index) alone.
std::array<double, 2> GaussianPair(phi::RandomKey key, std::uint64_t index);

}  // namespace colmap_ext

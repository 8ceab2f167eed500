// What a camera makes of radiance: exposure, noise, 8 bits, and the file's compression.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "colmap_ext/synthetic/solid_texture.h"
#include "phi/backend.h"
#include "phi/base/random.h"

namespace colmap_ext {

struct SensorOptions {
  double gain = 1;  // exposure
  double noise_sigma =
      0;  // grey levels; the same draw for red, green and blue, so that it is the grey image's sigma
  phi::RandomKey key;
};

using Rgb8 = std::array<std::uint8_t, 3>;

phi::Array2D<Rgb8> Develop(const phi::Array2D<Radiance>& radiance, const SensorOptions& options);

// Rec. 601 luma, rounded.
phi::GrayImage ToGray(const phi::Array2D<Rgb8>& image);

// The bytes of a JPEG file; quality 0 stands for PNG.
std::vector<std::uint8_t> EncodeImage(const phi::Array2D<Rgb8>& image, int jpeg_quality);
phi::GrayImage DecodeGray(const std::vector<std::uint8_t>& file);

// Standard normal draw of one pixel.
float GaussianNoise(phi::RandomKey key, std::uint64_t pixel);

}  // namespace colmap_ext

#include "colmap_ext/synthetic/solid_texture.h"

#include <cmath>

namespace colmap_ext {
namespace {

// A bijective mix of 32 bits with good avalanche (the finaliser of MurmurHash3's 32-bit form).
std::uint32_t Mix(std::uint32_t h) {
  h ^= h >> 16;
  h *= 0x85ebca6bu;
  h ^= h >> 13;
  h *= 0xc2b2ae35u;
  return h ^ (h >> 16);
}

double LatticeValue(std::uint32_t row_hash, std::int32_t x) {
  return Mix(row_hash + static_cast<std::uint32_t>(x) * 0x9E3779B1u) * (1.0 / 4294967295.0);
}

double Fade(double t) { return t * t * (3 - 2 * t); }

// A rotation that no axis-aligned surface shares, so that no wall lies along a layer of lattice cells.
const Eigen::Matrix3d& LatticeRotation() {
  static const Eigen::Matrix3d rotation = [] {
    Eigen::Matrix3d r;
    r << 2, -2, 1, 1, 2, 2, -2, -1, 2;  // orthogonal, rows of length 3
    return Eigen::Matrix3d(r / 3);
  }();
  return rotation;
}

// A soft step around 1/2 that spreads a sum of octaves, which crowds there, over [0, 1].
double Spread(double v) { return 0.5 + 0.5 * std::tanh(4.0 * (v - 0.5)); }

}  // namespace

double ValueNoise(std::uint32_t seed, const Eigen::Vector3d& point) {
  const double fx = std::floor(point.x()), fy = std::floor(point.y()), fz = std::floor(point.z());
  const std::int32_t x = static_cast<std::int32_t>(fx);
  const double wx = Fade(point.x() - fx), wy = Fade(point.y() - fy), wz = Fade(point.z() - fz);
  double layers[2];
  for (int dz = 0; dz < 2; ++dz) {
    const std::uint32_t layer = Mix(seed ^ static_cast<std::uint32_t>(static_cast<std::int32_t>(fz) + dz));
    double rows[2];
    for (int dy = 0; dy < 2; ++dy) {
      const std::uint32_t row = Mix(layer + static_cast<std::uint32_t>(static_cast<std::int32_t>(fy) + dy));
      const double left = LatticeValue(row, x), right = LatticeValue(row, x + 1);
      rows[dy] = left + wx * (right - left);
    }
    layers[dz] = rows[0] + wy * (rows[1] - rows[0]);
  }
  return layers[0] + wz * (layers[1] - layers[0]);
}

Radiance SolidTexture::At(const Eigen::Vector3d& point) const {
  std::uint32_t tile = seed;
  for (int axis = 0; axis < 3; ++axis) {
    tile = Mix(tile * 31 + static_cast<std::uint32_t>(
                               static_cast<std::int32_t>(std::floor(point[axis] / tile_size[axis]))));
  }
  const Eigen::Vector3d p = LatticeRotation() * point.cwiseQuotient(stretch);
  double sum = 0, total = 0, amplitude = 1;
  std::uint32_t octave = 0;
  for (double spacing = coarsest_spacing; spacing >= finest_spacing; spacing /= 2) {
    sum += amplitude * ValueNoise(tile + octave++, p / spacing);
    total += amplitude;
    amplitude *= persistence;
  }
  const double tone = tile * (1.0 / 4294967295.0);
  const double pattern = total > 0 ? Spread(sum / total) : 0.5;
  const float v = static_cast<float>(pattern + tile_contrast * (tone - pattern));
  return dark + v * (light - dark);
}

Radiance Paint::At(const Eigen::Vector3d& point) const {
  const double v = ValueNoise(seed, LatticeRotation() * point / spacing) - 0.5;
  return color + Radiance::Constant(static_cast<float>(contrast * v));
}

}  // namespace colmap_ext

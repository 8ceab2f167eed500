// Cells of a grid through the clouds' origin.
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstdint>
#include <limits>

#include "phi/base/vec.h"

namespace colmap_ext {

struct Voxel {
  std::int32_t x, y, z;

  auto operator<=>(const Voxel&) const = default;

  std::uint32_t Hash() const {
    std::uint32_t h = static_cast<std::uint32_t>(x) * 0x9E3779B1u;
    h = (h ^ static_cast<std::uint32_t>(y)) * 0x85EBCA77u;
    h = (h ^ static_cast<std::uint32_t>(z)) * 0xC2B2AE3Du;
    return h ^ (h >> 16);
  }
};

// voxel_size: world units; shift: of the grid, in voxels. Points beyond 2^31 voxels from the origin fall into the outermost.
inline Voxel VoxelOf(const phi::Vec3f& point, double voxel_size, double shift) {
  constexpr double kLimit = std::numeric_limits<std::int32_t>::max();
  const auto index = [&](float coordinate) {
    return static_cast<std::int32_t>(std::clamp(std::floor(coordinate / voxel_size + shift), -kLimit, kLimit));
  };
  return {index(point.x), index(point.y), index(point.z)};
}

}  // namespace colmap_ext

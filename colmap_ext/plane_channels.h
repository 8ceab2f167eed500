// Components of planes, each kind by itself: as COLMAP's files hold them, and so that loops over them become vector instructions.
#pragma once

#include <cstddef>
#include <vector>

#include "phi/geometry/plane_hypothesis.h"

namespace colmap_ext {

struct PlaneChannels {
  std::vector<float> x, y, z;  // of the normals
  std::vector<float> depth;

  // Room for so many planes at most.
  explicit PlaneChannels(std::size_t capacity) : x(capacity), y(capacity), z(capacity), depth(capacity) {}

  // The first `size` of each are those of `planes` then.
  void Load(const phi::PlaneHypothesis* planes, std::size_t size);
  // The other way round.
  void Store(std::size_t size, phi::PlaneHypothesis* planes) const;
};

}  // namespace colmap_ext

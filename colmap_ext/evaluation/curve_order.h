// Puts clouds into an order in which points that follow one another are near one another, for what looks around points or collects
// those of a voxel.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "phi/base/vec.h"

namespace colmap_ext {

// A Z-shaped curve through the cells of a grid. Voxels are whole numbers of cells, so that it passes each of them once, unless there are
// more than 2^21 along the points' box: then cells are whole numbers of voxels.
class SpaceCurve {
 public:
  // Cells as fine as can be around these points; others are placed in the outermost cells. `voxel_size`: world units.
  SpaceCurve(const std::vector<phi::Vec3f>& around, double voxel_size);

  std::uint64_t PlaceOf(const phi::Vec3f& point) const;

 private:
  double voxel_size_, cells_per_voxel_ = 1;
  double first_[3];  // by axis: number of the first cell
};

// The order of points [begin, end) along the curve, as indices from `begin` on. Needs kBytesPerOrderedPoint of memory for each, with what
// Reorder needs.
std::vector<std::uint32_t> OrderAlong(const SpaceCurve& curve, const std::vector<phi::Vec3f>& points,
                                      std::size_t begin, std::size_t end);
inline constexpr std::size_t kBytesPerOrderedPoint = 20;

// Of a property of the points; none where there is none.
template <typename T>
void Reorder(const std::vector<std::uint32_t>& order, std::size_t begin, std::vector<T>& values) {
  if (values.empty()) return;
  std::vector<T> ordered;
  ordered.reserve(order.size());
  for (const std::uint32_t i : order) ordered.push_back(values[begin + i]);
  std::copy(ordered.begin(), ordered.end(), values.begin() + static_cast<std::ptrdiff_t>(begin));
}

}  // namespace colmap_ext

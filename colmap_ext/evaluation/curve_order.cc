#include "colmap_ext/evaluation/curve_order.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <compare>

namespace colmap_ext {
namespace {

using phi::Vec3f;

constexpr int kBits = 21;  // of each axis

// Two zeros between the bits of a number below 2^21.
std::uint64_t Spread(std::uint64_t v) {
  v = (v | v << 32) & 0x001F00000000FFFF;
  v = (v | v << 16) & 0x001F0000FF0000FF;
  v = (v | v << 8) & 0x100F00F00F00F00F;
  v = (v | v << 4) & 0x10C30C30C30C30C3;
  return (v | v << 2) & 0x1249249249249249;
}

struct Place {
  std::uint64_t along;
  std::uint32_t index;

  auto operator<=>(const Place&) const = default;
};

}  // namespace

SpaceCurve::SpaceCurve(const std::vector<Vec3f>& around, double voxel_size) : voxel_size_(voxel_size) {
  Eigen::AlignedBox3f box;
  for (const Vec3f& p : around) box.extend(Eigen::Vector3f(p.x, p.y, p.z));
  double side = 1;  // voxels
  for (int axis = 0; axis < 3; ++axis) {
    first_[axis] = std::floor(box.min()[axis] / voxel_size);
    side = std::max(side, std::floor(box.max()[axis] / voxel_size) - first_[axis] + 1);
  }
  cells_per_voxel_ = std::exp2(kBits - std::ceil(std::log2(side)));
  for (double& first : first_) first = std::floor(first * cells_per_voxel_);
}

std::uint64_t SpaceCurve::PlaceOf(const Vec3f& p) const {
  constexpr double kLast = (1 << kBits) - 1;
  const auto cell = [&](float coordinate, double first) {
    const double number = std::floor(coordinate / voxel_size_ * cells_per_voxel_) - first;
    return static_cast<std::uint64_t>(std::min(std::max(0.0, number), kLast));  // 0 for what is no number
  };
  return Spread(cell(p.x, first_[0])) << 2 | Spread(cell(p.y, first_[1])) << 1 | Spread(cell(p.z, first_[2]));
}

std::vector<std::uint32_t> OrderAlong(const SpaceCurve& curve, const std::vector<Vec3f>& points,
                                      std::size_t begin, std::size_t end) {
  std::vector<Place> places(end - begin);
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
    places[i] = {curve.PlaceOf(points[begin + i]), static_cast<std::uint32_t>(i)};
  });
  tbb::parallel_sort(places.begin(), places.end());
  std::vector<std::uint32_t> order;
  order.reserve(places.size());
  for (const Place& place : places) order.push_back(place.index);
  return order;
}

}  // namespace colmap_ext

#include "colmap_ext/map_statistics.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "colmap_ext/thinning.h"

namespace colmap_ext {
namespace {

constexpr double kDegreesPerRadian = 57.29577951308232;

bool IsValidDepth(float depth) { return std::isfinite(depth) && depth > 0; }
bool IsValidNormal(const phi::Vec3f& n) { return phi::Dot(n, n) > 0; }

MapStatistics Summarize(std::vector<float> valid, std::size_t num_pixels) {
  MapStatistics statistics;
  statistics.num_pixels = static_cast<std::int64_t>(num_pixels);
  statistics.num_valid = static_cast<std::int64_t>(valid.size());
  if (valid.empty()) return statistics;
  const auto rank = [&](double share) {
    return valid.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(valid.size() - 1));
  };
  const auto low = rank(0.02), median = rank(0.5), high = rank(0.98);
  std::nth_element(valid.begin(), median, valid.end());
  statistics.median = *median;
  std::nth_element(valid.begin(), low, median);  // what is at `median` has no smaller one behind it
  statistics.low = *low;
  std::nth_element(median, high, valid.end());
  statistics.high = *high;
  return statistics;
}

double AngleDegrees(const phi::Vec3f& a, const phi::Vec3f& b) {
  const double cosine = phi::Dot(a, b) / (phi::Norm(a) * phi::Norm(b));
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * kDegreesPerRadian;
}

// is_valid(value); error(value, truth).
template <typename T, typename IsValid, typename ErrorOf>
MapAccuracy Compare(const phi::Array2D<T>& map, const phi::Array2D<T>& truth, double max_error,
                    IsValid is_valid, ErrorOf error) {
  MapAccuracy accuracy;
  for (int y = 0; y < map.height(); ++y) {
    const int true_y = NearestPixel(y, map.height(), truth.height());
    for (int x = 0; x < map.width(); ++x) {
      const T& expected = truth(NearestPixel(x, map.width(), truth.width()), true_y);
      if (!is_valid(expected)) continue;
      ++accuracy.num_truth;
      if (!is_valid(map(x, y))) continue;
      ++accuracy.num_kept;
      if (error(map(x, y), expected) <= max_error) ++accuracy.num_within;
    }
  }
  return accuracy;
}

}  // namespace

MapStatistics DepthStatistics(const phi::Array2D<float>& depth) {
  std::vector<float> valid;
  valid.reserve(depth.size());
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(valid), IsValidDepth);
  return Summarize(std::move(valid), depth.size());
}

MapStatistics CostStatistics(const phi::Array2D<float>& cost) {
  std::vector<float> valid;
  std::copy_if(cost.begin(), cost.end(), std::back_inserter(valid), [](float c) { return std::isfinite(c); });
  return Summarize(std::move(valid), cost.size());
}

MapStatistics NormalStatistics(const phi::Array2D<phi::Vec3f>& normals) {
  std::vector<float> angles;
  for (const phi::Vec3f& n : normals) {
    if (IsValidNormal(n)) angles.push_back(static_cast<float>(AngleDegrees(n, {0, 0, -1})));
  }
  return Summarize(std::move(angles), normals.size());
}

void MapAccuracy::Add(const MapAccuracy& other) {
  num_truth += other.num_truth;
  num_kept += other.num_kept;
  num_within += other.num_within;
}

MapAccuracy CompareDepth(const phi::Array2D<float>& depth, const phi::Array2D<float>& truth,
                         double max_error) {
  return Compare(depth, truth, max_error, IsValidDepth, [](float d, float expected) {
    return std::abs(static_cast<double>(d) - expected) / expected;
  });
}

MapAccuracy CompareNormals(const phi::Array2D<phi::Vec3f>& normals, const phi::Array2D<phi::Vec3f>& truth,
                           double max_error) {
  return Compare(normals, truth, max_error, IsValidNormal, AngleDegrees);
}

}  // namespace colmap_ext

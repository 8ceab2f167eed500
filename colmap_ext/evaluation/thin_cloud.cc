#include "colmap_ext/evaluation/thin_cloud.h"

#include <tbb/parallel_sort.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

#include "colmap_ext/evaluation/voxel.h"
#include "phi/base/cancellation.h"

namespace colmap_ext {
namespace {

using phi::Vec3f;

struct PointInVoxel {
  Voxel voxel;
  std::size_t index;  // of the point

  auto operator<=>(const PointInVoxel&) const = default;
};

// Sorted, so the points of a voxel stand together and in their order.
Vec3f MeanOf(const std::vector<Vec3f>& points, const PointInVoxel* begin, const PointInVoxel* end) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const PointInVoxel* entry = begin; entry != end; ++entry) {
    const Vec3f& p = points[entry->index];
    sum += Eigen::Vector3d(p.x, p.y, p.z);
  }
  const Eigen::Vector3f mean = (sum / static_cast<double>(end - begin)).cast<float>();
  return {mean.x(), mean.y(), mean.z()};
}

}  // namespace

std::vector<Vec3f> ThinCloud(std::vector<Vec3f> points, double voxel_size, std::size_t working_memory) {
  const auto num_passes = static_cast<std::uint32_t>(
      1 + points.size() * sizeof(PointInVoxel) / std::max<std::size_t>(working_memory, std::size_t{1} << 20));
  std::vector<std::size_t> num_entries(num_passes, 0);
  for (const Vec3f& p : points) ++num_entries[VoxelOf(p, voxel_size, 0).Hash() % num_passes];
  std::vector<PointInVoxel> entries;
  entries.reserve(*std::max_element(num_entries.begin(), num_entries.end()));
  // The mean takes the place of its voxel's first point. It lies in the same voxel, rounded or not, and so in no later pass.
  std::vector<bool> is_mean(points.size(), false);
  for (std::uint32_t pass = 0; pass < num_passes; ++pass) {
    phi::ThrowIfCancelled();
    entries.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Voxel voxel = VoxelOf(points[i], voxel_size, 0);
      if (voxel.Hash() % num_passes == pass) entries.push_back({voxel, i});
    }
    tbb::parallel_sort(entries.begin(), entries.end());
    for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
      while (end < entries.size() && entries[end].voxel == entries[begin].voxel) ++end;
      const std::size_t first = entries[begin].index;
      points[first] = MeanOf(points, entries.data() + begin, entries.data() + end);
      is_mean[first] = true;
    }
  }
  std::vector<PointInVoxel>().swap(entries);
  std::size_t num_kept = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (is_mean[i]) points[num_kept++] = points[i];
  }
  points.resize(num_kept);
  points.shrink_to_fit();
  return points;
}

}  // namespace colmap_ext

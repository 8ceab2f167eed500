#include "colmap_ext/evaluation/voxel_average.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstdint>

#include "colmap_ext/evaluation/voxel.h"
#include "phi/base/cancellation.h"

namespace colmap_ext {
namespace {

using phi::Vec3f;

struct VoxelEntry {
  Voxel voxel;
  ToleranceClass verdict;

  bool operator<(const VoxelEntry& other) const { return voxel < other.voxel; }
};

// The entries of one pass: the voxels whose hash falls to it. Sorted, so the order of collection does not
// matter.
std::vector<VoxelEntry> CollectPass(const std::vector<Vec3f>& points,
                                    const std::vector<ToleranceClass>& classes, double voxel_size,
                                    double shift, std::uint32_t pass, std::uint32_t num_passes) {
  tbb::enumerable_thread_specific<std::vector<VoxelEntry>> parts;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 1 << 16), [&](const auto& range) {
    std::vector<VoxelEntry>& part = parts.local();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      if (classes[i] & kNotCounted) continue;
      const VoxelEntry entry{VoxelOf(points[i], voxel_size, shift), classes[i]};
      if (num_passes == 1 || entry.voxel.Hash() % num_passes == pass) part.push_back(entry);
    }
  });
  std::vector<VoxelEntry> entries;
  for (std::vector<VoxelEntry>& part : parts) {
    entries.insert(entries.end(), part.begin(), part.end());
    std::vector<VoxelEntry>().swap(part);
  }
  tbb::parallel_sort(entries.begin(), entries.end());
  return entries;
}

class ShareSums {
 public:
  explicit ShareSums(std::size_t num_tolerances) : sum_(num_tolerances, 0.0), voxels_(num_tolerances, 0) {}

  void AddVoxel(const VoxelEntry* begin, const VoxelEntry* end) {
    // Counts by first right tolerance; a running total over the classes then gives each tolerance its shares.
    std::size_t first_right[kMaxTolerances + 1] = {}, contradicted[kMaxTolerances + 1] = {};
    for (const VoxelEntry* entry = begin; entry != end; ++entry) {
      const int c = FirstRightTolerance(entry->verdict);
      ++first_right[c];
      if (!(entry->verdict & kUnobservedBelow)) ++contradicted[c];
    }
    std::size_t right = 0, wrong = 0;
    for (std::size_t t = 0; t <= sum_.size(); ++t) wrong += contradicted[t];
    for (std::size_t t = 0; t < sum_.size(); ++t) {
      right += first_right[t];
      wrong -= contradicted[t];
      if (right + wrong == 0) continue;
      sum_[t] += static_cast<double>(right) / static_cast<double>(right + wrong);
      ++voxels_[t];
    }
  }

  std::vector<double> Means() const {
    std::vector<double> means;
    for (std::size_t t = 0; t < sum_.size(); ++t) {
      means.push_back(voxels_[t] == 0 ? 0.0 : sum_[t] / static_cast<double>(voxels_[t]));
    }
    return means;
  }

 private:
  std::vector<double> sum_;
  std::vector<std::size_t> voxels_;
};

}  // namespace

std::vector<double> AverageOverVoxels(const std::vector<Vec3f>& points,
                                      const std::vector<ToleranceClass>& classes, std::size_t num_tolerances,
                                      const VoxelAverageOptions& options) {
  ShareSums sums(num_tolerances);
  // Twice the entries: a part per thread and the joined array exist together for a moment.
  const std::size_t bytes = 2 * points.size() * sizeof(VoxelEntry);
  const auto num_passes = static_cast<std::uint32_t>(
      1 + bytes / std::max<std::size_t>(options.working_memory, std::size_t{1} << 20));
  const std::vector<double> shifts =
      options.shifted_grid ? std::vector<double>{0.0, 0.5} : std::vector<double>{0.0};
  for (double shift : shifts) {
    for (std::uint32_t pass = 0; pass < num_passes; ++pass) {
      phi::ThrowIfCancelled();
      const std::vector<VoxelEntry> entries =
          CollectPass(points, classes, options.voxel_size, shift, pass, num_passes);
      for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
        while (end < entries.size() && entries[end].voxel == entries[begin].voxel) ++end;
        sums.AddVoxel(entries.data() + begin, entries.data() + end);
      }
    }
  }
  return sums.Means();
}

}  // namespace colmap_ext

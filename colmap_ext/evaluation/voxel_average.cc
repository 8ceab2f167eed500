#include "colmap_ext/evaluation/voxel_average.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "colmap_ext/evaluation/voxel.h"
#include "phi/base/cancellation.h"

namespace colmap_ext {
namespace {

using phi::Vec3f;

// Points of one voxel that follow one another.
struct VoxelRun {
  Voxel voxel;
  std::uint32_t count;
  std::size_t begin;

  bool operator<(const VoxelRun& other) const { return voxel < other.voxel; }
};

// The runs of one pass: the voxels whose hash falls to it. Sorted, so the order of collection does not matter.
std::vector<VoxelRun> CollectPass(const std::vector<Vec3f>& points, double voxel_size, double shift,
                                  std::uint32_t pass, std::uint32_t num_passes) {
  tbb::enumerable_thread_specific<std::vector<VoxelRun>> parts;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 1 << 16), [&](const auto& range) {
    std::vector<VoxelRun>& part = parts.local();
    VoxelRun run{{}, 0, 0};
    const auto end_run = [&] {
      if (run.count > 0 && (num_passes == 1 || run.voxel.Hash() % num_passes == pass)) part.push_back(run);
    };
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Voxel voxel = VoxelOf(points[i], voxel_size, shift);
      if (run.count == 0 || voxel != run.voxel) {
        end_run();
        run = {voxel, 0, i};
      }
      ++run.count;
    }
    end_run();
  });
  std::vector<VoxelRun> runs;
  for (std::vector<VoxelRun>& part : parts) {
    runs.insert(runs.end(), part.begin(), part.end());
    std::vector<VoxelRun>().swap(part);
  }
  tbb::parallel_sort(runs.begin(), runs.end());
  return runs;
}

class ShareSums {
 public:
  explicit ShareSums(std::size_t num_tolerances) : sum_(num_tolerances, 0.0), voxels_(num_tolerances, 0) {}

  void AddVoxels(const std::vector<VoxelRun>& runs, const std::vector<ToleranceClass>& classes) {
    for (std::size_t begin = 0, end = 0; begin < runs.size(); begin = end) {
      while (end < runs.size() && runs[end].voxel == runs[begin].voxel) ++end;
      AddVoxel(runs.data() + begin, runs.data() + end, classes);
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
  void AddVoxel(const VoxelRun* begin, const VoxelRun* end, const std::vector<ToleranceClass>& classes) {
    // Counts by first right tolerance; a running total over the classes then gives each tolerance its shares.
    std::array<std::size_t, kMaxTolerances + 1> first_right = {}, contradicted = {};
    for (const VoxelRun* run = begin; run != end; ++run) {
      for (std::size_t i = run->begin; i < run->begin + run->count; ++i) {
        if (classes[i] & kNotCounted) continue;
        const int c = FirstRightTolerance(classes[i]);
        ++first_right[c];
        if (!(classes[i] & kUnobservedBelow)) ++contradicted[c];
      }
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

  std::vector<double> sum_;
  std::vector<std::size_t> voxels_;
};

}  // namespace

std::vector<std::vector<double>> AverageOverVoxels(const std::vector<Vec3f>& points,
                                                   const std::vector<std::vector<ToleranceClass>>& verdicts,
                                                   std::size_t num_tolerances, const VoxelAverageOptions& options) {
  std::vector<ShareSums> sums(verdicts.size(), ShareSums(num_tolerances));
  // Twice the runs, of a point each: a part per thread and the joined array exist together for a moment.
  const std::size_t bytes = 2 * points.size() * sizeof(VoxelRun);
  const auto num_passes = static_cast<std::uint32_t>(
      1 + bytes / std::max<std::size_t>(options.working_memory, std::size_t{1} << 20));
  const std::vector<double> shifts =
      options.shifted_grid ? std::vector<double>{0.0, 0.5} : std::vector<double>{0.0};
  for (double shift : shifts) {
    for (std::uint32_t pass = 0; pass < num_passes; ++pass) {
      phi::ThrowIfCancelled();
      const std::vector<VoxelRun> runs = CollectPass(points, options.voxel_size, shift, pass, num_passes);
      tbb::parallel_for(std::size_t{0}, verdicts.size(),
                        [&](std::size_t i) { sums[i].AddVoxels(runs, verdicts[i]); });
    }
  }
  std::vector<std::vector<double>> means;
  for (const ShareSums& of : sums) means.push_back(of.Means());
  return means;
}

}  // namespace colmap_ext

#include "colmap_ext/evaluation/cloud_evaluation.h"

#include <algorithm>

#include "colmap_ext/evaluation/nearest_class.h"
#include "colmap_ext/evaluation/voxel_average.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

// Index of the point in a block order, its class, and the point itself.
constexpr std::size_t kBytesPerPoint = sizeof(phi::Vec3f) + sizeof(std::uint32_t) + sizeof(ToleranceClass);

std::size_t WorkingMemory(const CloudPair& clouds, const CloudEvaluationOptions& options) {
  const std::size_t needed =
      (clouds.points.size() + clouds.truth.size() + clouds.truth_left_out.size()) * kBytesPerPoint +
      clouds.inferred.size() * sizeof(ToleranceClass) +
      clouds.truth_views.size() * (sizeof(std::uint8_t) + sizeof(ToleranceClass));
  if (needed >= options.memory) {
    throw phi::ResourceError(
        phi::AboutStage("evaluate") + ": the two clouds need " + std::to_string((needed >> 20) + 1) +
        " MiB before any search, more than --memory allows; raise it or thin the clouds");
  }
  return options.memory - needed;
}

std::vector<ToleranceClass> ClassifyPoints(const CloudPair& clouds, const CloudEvaluationOptions& options,
                                           std::size_t working_memory) {
  std::vector<ToleranceClass> classes =
      clouds.scans.empty()
          ? ClassifyByNearest(clouds.points, clouds.truth, options.tolerances, working_memory)
          : ClassifyByBeams(clouds.points, clouds.scans, options.tolerances);
  for (std::size_t i = 0; i < clouds.counted.size(); ++i) {
    if (!clouds.counted[i]) classes[i] = kNotCounted;
  }
  return classes;
}

// `classes`: of all points. Those of the other origin do not count.
OriginAccuracy AccuracyOf(bool inferred, const CloudPair& clouds, std::vector<ToleranceClass> classes,
                          std::size_t num_tolerances, const VoxelAverageOptions& voxels) {
  OriginAccuracy result;
  for (std::size_t i = 0; i < classes.size(); ++i) {
    if (clouds.inferred[i] != inferred) classes[i] = kNotCounted;
    result.num_counted += classes[i] != kNotCounted;
  }
  result.accuracy = AverageOverVoxels(clouds.points, classes, num_tolerances, voxels);
  for (double& share : result.accuracy) share *= 100;
  return result;
}

// `classes`: of all points, against the true points that count. A point is right where either truth is near.
std::vector<double> AccuracyOfAll(const CloudPair& clouds, std::vector<ToleranceClass> classes,
                                  const CloudEvaluationOptions& options, const VoxelAverageOptions& voxels) {
  const std::vector<ToleranceClass> others =
      ClassifyByNearest(clouds.points, clouds.truth_left_out, options.tolerances, voxels.working_memory);
  for (std::size_t i = 0; i < classes.size(); ++i) {
    if (classes[i] != kNotCounted) classes[i] = std::min(classes[i], others[i]);
  }
  std::vector<double> result = AverageOverVoxels(clouds.points, classes, options.tolerances.size(), voxels);
  for (double& share : result) share *= 100;
  return result;
}

// `classes`: of all true points.
std::vector<ViewsCompleteness> CompletenessByViews(const CloudPair& clouds,
                                                   const std::vector<ToleranceClass>& classes,
                                                   std::size_t num_tolerances,
                                                   const VoxelAverageOptions& voxels) {
  std::vector<ViewsCompleteness> result{{"0-1", 0, 1, 0, {}},
                                        {"2", 2, 2, 0, {}},
                                        {"3", 3, 3, 0, {}},
                                        {"4-5", 4, 5, 0, {}},
                                        {"6+", 6, 255, 0, {}}};
  for (ViewsCompleteness& of : result) {
    std::vector<ToleranceClass> own = classes;
    for (std::size_t i = 0; i < own.size(); ++i) {
      const int views = clouds.truth_views[i];
      if (views < of.min_views || views > of.max_views) {
        own[i] = kNotCounted;
      } else {
        ++of.num_truth;
      }
    }
    if (of.num_truth == 0) continue;
    of.completeness = AverageOverVoxels(clouds.truth, own, num_tolerances, voxels);
    for (double& share : of.completeness) share *= 100;
  }
  std::erase_if(result, [](const ViewsCompleteness& of) { return of.num_truth == 0; });
  return result;
}

double HarmonicMean(double a, double b) { return a + b > 0 ? 2 * a * b / (a + b) : 0; }

}  // namespace

std::string CloudEvaluationOptions::Check() const {
  if (std::string error = CheckTolerances(tolerances); !error.empty()) return error;
  if (!(voxel_size > 0)) return "--voxel_size must be positive";
  return "";
}

CloudScores EvaluateCloud(const CloudPair& clouds, const CloudEvaluationOptions& options) {
  const std::size_t working_memory = WorkingMemory(clouds, options);
  const VoxelAverageOptions voxels{options.voxel_size, working_memory, !clouds.scans.empty()};
  const std::size_t num_tolerances = options.tolerances.size();
  CloudScores scores;
  scores.tolerances = options.tolerances;
  scores.num_points = clouds.points.size();
  scores.num_truth = clouds.truth.size();
  scores.num_counted =
      clouds.counted.empty()
          ? clouds.points.size()
          : static_cast<std::size_t>(std::count(clouds.counted.begin(), clouds.counted.end(), true));

  {
    const std::vector<ToleranceClass> classes = ClassifyPoints(clouds, options, working_memory);
    scores.accuracy = AverageOverVoxels(clouds.points, classes, num_tolerances, voxels);
    if (!clouds.truth_left_out.empty() && clouds.scans.empty()) {
      scores.accuracy_of_all = AccuracyOfAll(clouds, classes, options, voxels);
    }
    if (!clouds.inferred.empty()) {
      scores.measured = AccuracyOf(false, clouds, classes, num_tolerances, voxels);
      scores.inferred = AccuracyOf(true, clouds, classes, num_tolerances, voxels);
    }
  }
  {
    const std::vector<ToleranceClass> classes =
        ClassifyByNearest(clouds.truth, clouds.points, options.tolerances, working_memory);
    scores.completeness = AverageOverVoxels(clouds.truth, classes, num_tolerances, voxels);
    if (!clouds.truth_views.empty()) {
      scores.by_views = CompletenessByViews(clouds, classes, num_tolerances, voxels);
    }
  }
  for (std::size_t t = 0; t < num_tolerances; ++t) {
    scores.accuracy[t] *= 100;
    scores.completeness[t] *= 100;
    scores.f1.push_back(HarmonicMean(scores.accuracy[t], scores.completeness[t]));
  }
  return scores;
}

}  // namespace colmap_ext

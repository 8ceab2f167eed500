#include "colmap_ext/evaluation/cloud_evaluation.h"

#include <algorithm>
#include <utility>

#include "colmap_ext/evaluation/curve_order.h"
#include "colmap_ext/evaluation/nearest_class.h"
#include "colmap_ext/evaluation/voxel_average.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

// The point and its class.
constexpr std::size_t kBytesPerPoint = sizeof(phi::Vec3f) + sizeof(ToleranceClass);
// Points that are put in order at once: indices have 32 bits.
constexpr std::size_t kMinOrdered = 65536, kMaxOrdered = std::size_t{1} << 31;

constexpr std::size_t kViewsClasses = 5;

std::size_t WorkingMemory(const CloudPair& clouds, const CloudEvaluationOptions& options) {
  const std::size_t needed =
      (clouds.points.size() + clouds.truth.size() + clouds.truth_left_out.size()) * kBytesPerPoint +
      (clouds.truth_left_out.empty() ? 0 : clouds.points.size() * sizeof(ToleranceClass)) +
      clouds.inferred.size() * 2 * sizeof(ToleranceClass) +
      clouds.truth_views.size() * (sizeof(std::uint8_t) + kViewsClasses * sizeof(ToleranceClass));
  if (needed >= options.memory) {
    throw phi::ResourceError(
        phi::AboutStage("evaluate") + ": the two clouds need " + std::to_string((needed >> 20) + 1) +
        " MiB before any search, more than --memory allows; raise it or thin the clouds");
  }
  return options.memory - needed;
}

// Along one curve; in pieces where the memory does not hold all, which costs time alone.
void Order(CloudPair& clouds, double voxel_size, std::size_t working_memory) {
  const SpaceCurve curve(clouds.truth, voxel_size);
  const std::size_t piece = std::clamp(working_memory / kBytesPerOrderedPoint, kMinOrdered, kMaxOrdered);
  const auto order = [&](std::vector<phi::Vec3f>& points, auto&... properties) {
    for (std::size_t begin = 0; begin < points.size(); begin += piece) {
      phi::ThrowIfCancelled();
      const auto places = OrderAlong(curve, points, begin, std::min(begin + piece, points.size()));
      Reorder(places, begin, points);
      (Reorder(places, begin, properties), ...);
    }
  };
  order(clouds.points, clouds.counted, clouds.inferred);
  order(clouds.truth, clouds.truth_views);
  order(clouds.truth_left_out);
}

std::vector<ToleranceClass> ClassifyPoints(const CloudPair& clouds, const std::vector<double>& tolerances,
                                           std::size_t working_memory) {
  std::vector<ToleranceClass> classes(clouds.points.size(), static_cast<ToleranceClass>(tolerances.size()));
  if (!clouds.scans.empty()) classes = ClassifyByBeams(clouds.points, clouds.scans, tolerances);
  for (std::size_t i = 0; i < clouds.counted.size(); ++i) {
    if (!clouds.counted[i]) classes[i] = kNotCounted;
  }
  if (clouds.scans.empty()) LowerToNearest(clouds.points, clouds.truth, tolerances, working_memory, classes);
  return classes;
}

// Those of the points alone of which `counts(index)` is true.
template <typename Counts>
std::vector<ToleranceClass> Part(std::vector<ToleranceClass> classes, Counts counts) {
  for (std::size_t i = 0; i < classes.size(); ++i) {
    if (!counts(i)) classes[i] = kNotCounted;
  }
  return classes;
}

std::size_t NumCounted(const std::vector<ToleranceClass>& classes) {
  return static_cast<std::size_t>(
      std::count_if(classes.begin(), classes.end(), [](ToleranceClass c) { return !(c & kNotCounted); }));
}

// Verdicts on the points of one cloud, and where the percentages of right points go.
class Percentages {
 public:
  const std::vector<ToleranceClass>& Add(std::vector<ToleranceClass> verdict, std::vector<double>* result) {
    verdicts_.push_back(std::move(verdict));
    results_.push_back(result);
    return verdicts_.back();
  }

  void Average(const std::vector<phi::Vec3f>& points, std::size_t num_tolerances, const VoxelAverageOptions& voxels) const {
    const std::vector<std::vector<double>> shares = AverageOverVoxels(points, verdicts_, num_tolerances, voxels);
    for (std::size_t i = 0; i < shares.size(); ++i) {
      for (const double share : shares[i]) results_[i]->push_back(share * 100);
    }
  }

 private:
  std::vector<std::vector<ToleranceClass>> verdicts_;
  std::vector<std::vector<double>*> results_;
};

void ScoreAccuracy(const CloudPair& clouds, const VoxelAverageOptions& voxels, CloudScores& scores) {
  Percentages percentages;
  const std::vector<ToleranceClass> classes = ClassifyPoints(clouds, scores.tolerances, voxels.working_memory);
  if (!clouds.truth_left_out.empty() && clouds.scans.empty()) {
    std::vector<ToleranceClass> of_all = classes;  // a point is right where either truth is near
    LowerToNearest(clouds.points, clouds.truth_left_out, scores.tolerances, voxels.working_memory, of_all);
    percentages.Add(std::move(of_all), &scores.accuracy_of_all.emplace());
  }
  if (!clouds.inferred.empty()) {
    for (const bool inferred : {false, true}) {
      OriginAccuracy& of = (inferred ? scores.inferred : scores.measured).emplace();
      of.num_counted = NumCounted(percentages.Add(
          Part(classes, [&](std::size_t i) { return clouds.inferred[i] == inferred; }), &of.accuracy));
    }
  }
  percentages.Add(classes, &scores.accuracy);
  percentages.Average(clouds.points, scores.tolerances.size(), voxels);
}

void ScoreCompleteness(const CloudPair& clouds, const VoxelAverageOptions& voxels, CloudScores& scores) {
  Percentages percentages;
  std::vector<ToleranceClass> classes(clouds.truth.size(), static_cast<ToleranceClass>(scores.tolerances.size()));
  LowerToNearest(clouds.truth, clouds.points, scores.tolerances, voxels.working_memory, classes);
  if (!clouds.truth_views.empty()) {
    scores.by_views = {{"0-1", 0, 1, 0, {}}, {"2", 2, 2, 0, {}}, {"3", 3, 3, 0, {}}, {"4-5", 4, 5, 0, {}}, {"6+", 6, 255, 0, {}}};
  }
  const auto is_of = [&](const ViewsCompleteness& of, int views) { return views >= of.min_views && views <= of.max_views; };
  for (ViewsCompleteness& of : scores.by_views) {
    of.num_truth = static_cast<std::size_t>(std::count_if(clouds.truth_views.begin(), clouds.truth_views.end(),
                                                          [&](std::uint8_t views) { return is_of(of, views); }));
  }
  std::erase_if(scores.by_views, [](const ViewsCompleteness& of) { return of.num_truth == 0; });
  for (ViewsCompleteness& of : scores.by_views) {
    percentages.Add(Part(classes, [&](std::size_t i) { return is_of(of, clouds.truth_views[i]); }), &of.completeness);
  }
  percentages.Add(std::move(classes), &scores.completeness);
  percentages.Average(clouds.truth, scores.tolerances.size(), voxels);
}

double HarmonicMean(double a, double b) { return a + b > 0 ? 2 * a * b / (a + b) : 0; }

}  // namespace

std::string CloudEvaluationOptions::Check() const {
  if (std::string error = CheckTolerances(tolerances); !error.empty()) return error;
  if (!(voxel_size > 0)) return "--voxel_size must be positive";
  return "";
}

CloudScores EvaluateCloud(CloudPair clouds, const CloudEvaluationOptions& options) {
  const std::size_t working_memory = WorkingMemory(clouds, options);
  CloudScores scores;
  scores.tolerances = options.tolerances;
  scores.num_points = clouds.points.size();
  scores.num_truth = clouds.truth.size();
  scores.num_counted =
      clouds.counted.empty()
          ? clouds.points.size()
          : static_cast<std::size_t>(std::count(clouds.counted.begin(), clouds.counted.end(), true));
  Order(clouds, options.voxel_size, working_memory);
  const VoxelAverageOptions voxels{options.voxel_size, working_memory, !clouds.scans.empty()};
  ScoreAccuracy(clouds, voxels, scores);
  ScoreCompleteness(clouds, voxels, scores);
  for (std::size_t t = 0; t < scores.tolerances.size(); ++t) {
    scores.f1.push_back(HarmonicMean(scores.accuracy[t], scores.completeness[t]));
  }
  return scores;
}

}  // namespace colmap_ext

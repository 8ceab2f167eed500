#include "phi/view_selection.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include <tbb/parallel_for.h>

#include "phi/base/cancellation.h"
#include "phi/sparse_depth.h"
#include "phi/view_coverage.h"
#include "phi/view_samples.h"

namespace phi {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

// With fewer views than these the geometric filter has too few witnesses, so views that the angle's bound rejects are
// taken after all: a weak view is better than a hole.
constexpr int kFewestViews = 4;
// A view that shares fewer points than these may share none but mismatched ones.
constexpr int kFewestSharedPoints = 3;
// --PatchMatchStereo.min_triangulation_angle bounds this percentile of the shared points' angles, as in COLMAP: where the
// camera moves forward, the points beside its path tell depth and those ahead do not.
constexpr double kAnglePercentile = 0.75;
// Cameras that stand at one place triangulate nothing: share of the angle's bound below which no view is taken.
constexpr double kOnePlace = 0.1;

// What all samples of a pair say.
struct PairSummary {
  int view = 0;
  int num_points = 0;
  double median_angle = 0, wide_angle = 0;  // radians; the latter at kAnglePercentile
  double displacement = 0;                  // mean: tau
};

// The value at a share of the sorted order. Reorders.
double Percentile(std::vector<float>& values, double share) {
  const auto index = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  const auto place = values.begin() + std::min<std::ptrdiff_t>(index, std::ssize(values) - 1);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

// Sorts before it sums, so that the mean does not depend on the points' order.
double MeanInPlace(std::vector<float>& values) {
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (const float value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

// By source view.
std::vector<PairSummary> Summarize(const std::vector<ViewSample>& samples, const Rules& rules) {
  const double wide_percentile =
      std::min(1.0, static_cast<double>(rules.Scale(Rule::kWeakViews)) * kAnglePercentile);
  struct Values {
    std::vector<float> angles, displacements;
  };
  std::vector<Values> of_view;
  for (const ViewSample& sample : samples) {
    const auto view = static_cast<std::size_t>(sample.view);
    if (of_view.size() <= view) of_view.resize(view + 1);
    of_view[view].angles.push_back(sample.angle);
    of_view[view].displacements.push_back(sample.displacement);
  }
  std::vector<PairSummary> all;
  for (std::size_t view = 0; view < of_view.size(); ++view) {
    auto& [angles, displacements] = of_view[view];
    if (angles.empty()) continue;
    all.push_back({.view = static_cast<int>(view),
                   .num_points = static_cast<int>(angles.size()),
                   .median_angle = Percentile(angles, 0.5),
                   .wide_angle = Percentile(angles, wide_percentile),
                   .displacement = MeanInPlace(displacements)});
  }
  return all;
}

SourceView MakeSourceView(const PairSummary& pair, bool from_points) {
  return {.view = pair.view,
          .num_shared_points = from_points ? pair.num_points : 0,
          .triangulation_angle = pair.median_angle * kDegrees,
          .displacement = pair.displacement};
}

bool IsSelected(const std::vector<SourceView>& selected, int view) {
  return std::any_of(selected.begin(), selected.end(),
                     [view](const SourceView& s) { return s.view == view; });
}

// Eq. 1 to 3, best first.
std::vector<SourceView> RankByPaper(const std::vector<SceneView>& views,
                                    const std::vector<Eigen::Vector3d>& centers,
                                    const ViewSelectionOptions& options, int reference,
                                    const std::vector<PairSummary>& pairs) {
  const auto axis = [&](int view) -> Eigen::Vector3d { return views[view].camera.pose.rotation.row(2); };
  std::vector<SourceView> ranked;
  for (const PairSummary& pair : pairs) {
    if (pair.displacement < options.min_displacement) continue;
    if (pair.median_angle * kDegrees < options.min_triangulation_angle)
      continue;  // not the paper's: its preset sets 0
    const double baseline = (centers[pair.view] - centers[reference]).norm();
    const double theta = AngleBetween(axis(reference), axis(pair.view));
    ranked.push_back(MakeSourceView(pair, /*from_points=*/true));
    ranked.back().score = std::min(baseline, 0.1) * std::min(theta, 0.05) / pair.num_points;
  }
  const auto id = [&](const SourceView& s) { return views[s.view].image_id; };
  std::sort(ranked.begin(), ranked.end(), [&](const SourceView& a, const SourceView& b) {
    return std::make_tuple(a.score, id(a)) < std::make_tuple(b.score, id(b));
  });
  return ranked;
}

// The pairs that some samples tell of: shared points, or those of the reference's frustum.
class CoveringPairs {
 public:
  CoveringPairs(const std::vector<ViewSample>& samples, const std::vector<std::uint32_t>& image_ids, const Rules& rules,
                bool from_points)
      : pairs_(Summarize(samples, rules)),
        coverage_(samples, image_ids, rules.Scale(Rule::kViewCoverage)),
        from_points_(from_points) {}

  const std::vector<PairSummary>& pairs() const { return pairs_; }

  // Appends views that cover the image, to at most `size`: those whose angles are at least min_angle degrees and below max_angle.
  void Cover(double min_angle, double max_angle, std::size_t size, std::vector<SourceView>* selected) {
    std::vector<int> candidates;
    for (const PairSummary& pair : pairs_) {
      const double angle = pair.wide_angle * kDegrees;
      if (pair.num_points >= kFewestSharedPoints && angle >= min_angle && angle < max_angle &&
          !IsSelected(*selected, pair.view)) {
        candidates.push_back(pair.view);
      }
    }
    if (selected->size() >= size) return;
    for (const int view : coverage_.Take(candidates, size - selected->size())) {
      const auto of_view =
          std::find_if(pairs_.begin(), pairs_.end(), [view](const PairSummary& pair) { return pair.view == view; });
      selected->push_back(MakeSourceView(*of_view, from_points_));
    }
  }

 private:
  std::vector<PairSummary> pairs_;
  ViewCoverage coverage_;
  bool from_points_;
};

}  // namespace

ViewSelector::ViewSelector(const std::vector<SceneView>& views, const SparseScene& scene,
                           const ViewSelectionOptions& options)
    : views_(views), scene_(scene), options_(options), visible_points_(scene) {
  centers_.reserve(views.size());
  image_ids_.reserve(views.size());
  for (const SceneView& view : views) {
    centers_.push_back(view.camera.pose.Center());
    image_ids_.push_back(view.image_id);
  }
}

std::vector<SourceView> ViewSelector::Select(int reference, int max_num_views) const {
  constexpr double kAnyAngle = 180;
  const std::size_t size = static_cast<std::size_t>(std::max(max_num_views, 0));
  const double bound = options_.min_triangulation_angle;
  ThrowIfCancelled();  // all of a large model take minutes
  const ViewSampler sampler(views_, centers_, options_, reference);
  const std::vector<ViewSample> samples = sampler.FromPoints(scene_, visible_points_[reference]);
  const Rules& rules = options_.method.rules;
  if (options_.method.formulas == Formulas::kPaper) {
    std::vector<SourceView> ranked = RankByPaper(views_, centers_, options_, reference, Summarize(samples, rules));
    ranked.resize(std::min(ranked.size(), size));
    return ranked;
  }
  const int wanted = rules.IsOn(Rule::kWeakViews) ? rules.Count(Rule::kWeakViews, kFewestViews) : 0;
  const std::size_t fewest = std::min<std::size_t>(size, wanted);
  std::vector<SourceView> selected;
  CoveringPairs sharing(samples, image_ids_, rules, /*from_points=*/true);
  if (rules.IsOn(Rule::kViewCoverage)) {
    sharing.Cover(bound, kAnyAngle, size, &selected);
  } else {
    selected = RankByPaper(views_, centers_, options_, reference, sharing.pairs());
    selected.resize(std::min(selected.size(), size));
  }
  sharing.Cover(kOnePlace * bound, bound, fewest, &selected);
  if (!rules.IsOn(Rule::kWeakViews) || selected.size() >= std::max<std::size_t>(fewest, 1)) return selected;

  const DepthRange range = DepthRangeWithoutOwnPoints(views_, scene_, reference);
  CoveringPairs looking(sampler.FromFrustum(range.min, range.max), image_ids_, rules, /*from_points=*/false);
  looking.Cover(bound, kAnyAngle, size, &selected);
  looking.Cover(kOnePlace * bound, bound, fewest, &selected);
  return selected;
}

std::vector<std::vector<SourceView>> SelectSourceViews(const std::vector<SceneView>& views,
                                                       const SparseScene& scene,
                                                       const ViewSelectionOptions& options) {
  const ViewSelector selector(views, scene, options);
  std::vector<std::vector<SourceView>> selected(views.size());
  tbb::parallel_for(std::size_t{0}, views.size(), [&](std::size_t view) {
    selected[view] = selector.Select(static_cast<int>(view), options.NumSelectedViews());
  });
  return selected;
}

}  // namespace phi

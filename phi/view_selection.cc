#include "phi/view_selection.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include <tbb/parallel_for.h>
#include <Eigen/Geometry>

#include "phi/initialization.h"

namespace phi {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

// With fewer views than these the geometric filter has too few witnesses, so views that the paper's rule
// rejects are taken after all: a weak view is better than a hole.
constexpr std::size_t kFewestViews = 4;
// A view that shares fewer points than these may share none but mismatched ones.
constexpr int kFewestSharedPoints = 3;
// The cameras' own evidence looks at so many candidates around the reference; the far ones of 10,000 cannot
// matter.
constexpr std::size_t kMostNearbyCameras = 128;
// A point that two views see from directions farther apart than this says little: no window matches itself there.
constexpr double kWidestAngle = 60 / kDegrees;

// What one point, seen by the reference and by one source view, says about the pair.
struct Sample {
  int view = 0;
  float angle = 0;         // triangulation angle, radians
  float displacement = 0;  // Eq. 2's summand, pixels of the source
  float log_scale = 0;     // log of pixels per surface length, source over reference
};

// All samples of one pair.
struct Evidence {
  int view = 0;
  int num_points = 0;
  double baseline = 0;             // world units
  double axes_angle = 0;           // between the principal axes, radians
  double triangulation_angle = 0;  // median, radians
  double displacement = 0;         // mean: tau
  double scale_change = 1;  // median, >= 1: how many times finer or coarser the source sees the surface
};

double FocalLength(const Pinhole& pinhole) { return std::sqrt(pinhole.fx * pinhole.fy); }

Eigen::Vector2d Project(const Pinhole& k, const Eigen::Vector3d& camera) {
  return {k.fx * camera.x() / camera.z() + k.cx, k.fy * camera.y() / camera.z() + k.cy};
}

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Reference, source and the point relative to their centres: world coordinates may be far from the origin.
struct Pair {
  const Camera& reference;
  const Camera& source;
  Eigen::Vector3d reference_center, source_center;
  double epsilon;       // of Eq. 1
  double widest_angle;  // radians
};

// False when the point is behind one of the cameras, or when `inside` asks for it and the source's image
// misses it.
bool Measure(const Pair& pair, const Eigen::Vector3d& world, bool inside, Sample* sample) {
  const Eigen::Vector3d from_reference = world - pair.reference_center;
  const Eigen::Vector3d from_source = world - pair.source_center;
  const Eigen::Vector3d in_source = pair.source.pose.rotation * from_source;
  const double depth_reference = pair.reference.pose.rotation.row(2) * from_reference;
  if (depth_reference <= 0 || in_source.z() <= 0) return false;
  const Pinhole& k = pair.source.pinhole;
  const Eigen::Vector2d pixel = Project(k, in_source);
  if (inside && (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > k.width || pixel.y() > k.height)) return false;
  // Eq. 1 moves the point along the reference's ray: (1 + eps) X - eps C.
  const Eigen::Vector3d moved = in_source + pair.epsilon * (pair.source.pose.rotation * from_reference);
  if (moved.z() <= 0) return false;
  sample->angle = static_cast<float>(AngleBetween(from_reference, from_source));
  if (sample->angle > pair.widest_angle) return false;
  sample->displacement = static_cast<float>((Project(k, moved) - pixel).norm());
  const double scale = FocalLength(k) / in_source.z() * depth_reference / FocalLength(pair.reference.pinhole);
  sample->log_scale = static_cast<float>(std::log(scale));
  return true;
}

double MedianInPlace(std::vector<float>& values) {
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Sorts before it sums, so that the mean does not depend on the points' order.
double MeanInPlace(std::vector<float>& values) {
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (const float value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

// Everything that ranks the candidates of one reference view.
class Ranking {
 public:
  Ranking(const std::vector<SceneView>& views, const std::vector<Eigen::Vector3d>& centers,
          const ViewSelectionOptions& options, int reference)
      : views_(views), centers_(centers), options_(options), reference_(reference) {}

  Pair MakePair(int source) const {
    return {views_[reference_].camera,
            views_[source].camera,
            centers_[reference_],
            centers_[source],
            options_.displacement_epsilon,
            options_.formulas == Formulas::kPaper ? std::numbers::pi : kWidestAngle};
  }

  // Groups the samples by source view.
  std::vector<Evidence> Summarize(std::vector<Sample> samples) const;
  // Splits into ranked and rejected, each best first.
  void Rank(std::vector<Evidence> evidence, bool from_points, std::vector<SourceView>* ranked,
            std::vector<SourceView>* rejected) const;

 private:
  double MedianBaseline(const std::vector<Evidence>& evidence) const;
  double Score(const Evidence& evidence, double median_baseline) const;

  const std::vector<SceneView>& views_;
  const std::vector<Eigen::Vector3d>& centers_;
  const ViewSelectionOptions& options_;
  int reference_;
};

std::vector<Evidence> Ranking::Summarize(std::vector<Sample> samples) const {
  std::stable_sort(samples.begin(), samples.end(),
                   [](const Sample& a, const Sample& b) { return a.view < b.view; });
  std::vector<Evidence> all;
  std::vector<float> angles, displacements, log_scales;
  for (std::size_t begin = 0, end = 0; begin < samples.size(); begin = end) {
    angles.clear();
    displacements.clear();
    log_scales.clear();
    for (end = begin; end < samples.size() && samples[end].view == samples[begin].view; ++end) {
      angles.push_back(samples[end].angle);
      displacements.push_back(samples[end].displacement);
      log_scales.push_back(samples[end].log_scale);
    }
    Evidence evidence;
    evidence.view = samples[begin].view;
    evidence.num_points = static_cast<int>(end - begin);
    evidence.baseline = (centers_[evidence.view] - centers_[reference_]).norm();
    evidence.axes_angle = AngleBetween(views_[reference_].camera.pose.rotation.row(2).transpose(),
                                       views_[evidence.view].camera.pose.rotation.row(2).transpose());
    evidence.triangulation_angle = MedianInPlace(angles);
    evidence.displacement = MeanInPlace(displacements);
    evidence.scale_change = std::exp(std::abs(MedianInPlace(log_scales)));
    all.push_back(evidence);
  }
  return all;
}

// Over the candidates: in a large scene the median over all images is the size of the site and tells nothing.
double Ranking::MedianBaseline(const std::vector<Evidence>& evidence) const {
  std::vector<float> baselines;
  for (const Evidence& e : evidence) baselines.push_back(static_cast<float>(e.baseline));
  return baselines.empty() ? 0 : MedianInPlace(baselines);
}

double Ranking::Score(const Evidence& e, double median_baseline) const {
  if (options_.formulas == Formulas::kPaper) {
    return std::min(e.baseline, 0.1) * std::min(e.axes_angle, 0.05) / e.num_points;
  }
  const double baseline = median_baseline > 0 ? std::max(e.baseline / median_baseline, 0.1) : 1;
  // The angle at the points, not between the axes: a camera that moves sideways without turning has parallel
  // axes at any baseline. A source that sees the surface at another scale compares blurred with sharp.
  return baseline * std::max(e.triangulation_angle, 0.05) * e.scale_change / e.num_points;
}

void Ranking::Rank(std::vector<Evidence> evidence, bool from_points, std::vector<SourceView>* ranked,
                   std::vector<SourceView>* rejected) const {
  const double median_baseline = MedianBaseline(evidence);
  for (const Evidence& e : evidence) {
    if (options_.formulas == Formulas::kRobust && e.num_points < kFewestSharedPoints) continue;
    SourceView source;
    source.view = e.view;
    source.score = Score(e, median_baseline);
    source.num_shared_points = from_points ? e.num_points : 0;
    source.triangulation_angle = e.triangulation_angle * kDegrees;
    source.displacement = e.displacement;
    const bool accepted = source.displacement >= options_.min_displacement &&
                          source.triangulation_angle >= options_.min_triangulation_angle;
    if (accepted) {
      ranked->push_back(source);
    } else if (source.displacement >= 0.1 * options_.min_displacement) {
      // Below that the cameras stand at one place and nothing can be triangulated.
      rejected->push_back(source);
    }
  }
  const auto id = [&](const SourceView& s) { return views_[s.view].image_id; };
  std::sort(ranked->begin(), ranked->end(), [&](const SourceView& a, const SourceView& b) {
    return std::make_tuple(a.score, id(a)) < std::make_tuple(b.score, id(b));
  });
  std::sort(rejected->begin(), rejected->end(), [&](const SourceView& a, const SourceView& b) {
    return std::make_tuple(-a.displacement, id(a)) < std::make_tuple(-b.displacement, id(b));
  });
}

std::vector<Sample> SamplesFromPoints(const Ranking& ranking, const SparseScene& scene,
                                      std::span<const std::uint32_t> points, int reference) {
  std::vector<Sample> samples;
  std::vector<std::uint32_t> last_slot(scene.num_views(), ~0u);  // a track may name a view twice
  for (std::uint32_t slot = 0; slot < points.size(); ++slot) {
    for (const PointObservation& observation : scene.track(points[slot])) {
      if (observation.view == reference || last_slot[observation.view] == slot) continue;
      last_slot[observation.view] = slot;
      Sample sample;
      sample.view = observation.view;
      const Pair pair = ranking.MakePair(observation.view);
      if (Measure(pair, scene.point(points[slot]), /*inside=*/false, &sample)) samples.push_back(sample);
    }
  }
  return samples;
}

// A grid of pixels at several depths stands for the unknown surface.
std::vector<Eigen::Vector3d> FrustumPoints(const Camera& camera, const Eigen::Vector3d& center,
                                           double depth_min, double depth_max) {
  constexpr int kColumns = 8, kRows = 6, kDepths = 6;
  const Pinhole& k = camera.pinhole;
  std::vector<Eigen::Vector3d> points;
  for (int d = 0; d < kDepths; ++d) {
    const double depth = depth_min * std::pow(depth_max / depth_min, (d + 0.5) / kDepths);
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        const double u = (column + 0.5) / kColumns * k.width, v = (row + 0.5) / kRows * k.height;
        const Eigen::Vector3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1);
        points.push_back(center + camera.pose.rotation.transpose() * (depth * ray));
      }
    }
  }
  return points;
}

// The nearest cameras, by image id where distances are equal.
std::vector<int> NearbyCameras(const std::vector<SceneView>& views,
                               const std::vector<Eigen::Vector3d>& centers, int reference) {
  std::vector<std::tuple<double, std::uint32_t, int>> order;
  for (int view = 0; view < static_cast<int>(views.size()); ++view) {
    if (view == reference) continue;
    order.emplace_back((centers[view] - centers[reference]).squaredNorm(), views[view].image_id, view);
  }
  const std::size_t count = std::min(order.size(), kMostNearbyCameras);
  std::partial_sort(order.begin(), order.begin() + count, order.end());
  std::vector<int> nearby;
  for (std::size_t i = 0; i < count; ++i) nearby.push_back(std::get<2>(order[i]));
  return nearby;
}

std::vector<Sample> SamplesFromFrustum(const Ranking& ranking, const std::vector<int>& candidates,
                                       const std::vector<Eigen::Vector3d>& points) {
  std::vector<Sample> samples;
  for (const int view : candidates) {
    const Pair pair = ranking.MakePair(view);
    Sample sample;
    sample.view = view;
    for (const Eigen::Vector3d& point : points) {
      if (Measure(pair, point, /*inside=*/true, &sample)) samples.push_back(sample);
    }
  }
  return samples;
}

void AppendNew(const std::vector<SourceView>& more, std::size_t size, std::vector<SourceView>* selected) {
  for (const SourceView& source : more) {
    if (selected->size() >= size) return;
    const bool known = std::any_of(selected->begin(), selected->end(),
                                   [&](const SourceView& s) { return s.view == source.view; });
    if (!known) selected->push_back(source);
  }
}

}  // namespace

ViewSelector::ViewSelector(const std::vector<SceneView>& views, const SparseScene& scene,
                           const ViewSelectionOptions& options)
    : views_(views), scene_(scene), options_(options), visible_points_(scene) {
  centers_.reserve(views.size());
  for (const SceneView& view : views) centers_.push_back(view.camera.pose.Center());
}

std::vector<SourceView> ViewSelector::Select(int reference, int max_num_views) const {
  const std::size_t size = static_cast<std::size_t>(std::max(max_num_views, 0));
  const Ranking ranking(views_, centers_, options_, reference);
  std::vector<SourceView> ranked, rejected;
  ranking.Rank(ranking.Summarize(SamplesFromPoints(ranking, scene_, visible_points_[reference], reference)),
               /*from_points=*/true, &ranked, &rejected);
  std::vector<SourceView> selected;
  AppendNew(ranked, size, &selected);
  if (options_.formulas == Formulas::kPaper) return selected;  // Eq. 3 and nothing else
  const std::size_t fewest = std::min(size, kFewestViews);
  if (selected.size() >= fewest) return selected;

  AppendNew(rejected, fewest, &selected);
  if (selected.size() >= fewest) return selected;

  const DepthRange range = DepthRangeWithoutOwnPoints(views_, scene_, reference);
  const Camera& camera = views_[reference].camera;
  const auto points = FrustumPoints(camera, centers_[reference], range.min, range.max);
  ranked.clear();
  rejected.clear();
  ranking.Rank(
      ranking.Summarize(SamplesFromFrustum(ranking, NearbyCameras(views_, centers_, reference), points)),
      /*from_points=*/false, &ranked, &rejected);
  AppendNew(ranked, size, &selected);
  AppendNew(rejected, fewest, &selected);
  return selected;
}

std::vector<std::vector<SourceView>> SelectSourceViews(const std::vector<SceneView>& views,
                                                       const SparseScene& scene,
                                                       const ViewSelectionOptions& options) {
  const ViewSelector selector(views, scene, options);
  std::vector<std::vector<SourceView>> selected(views.size());
  tbb::parallel_for(std::size_t{0}, views.size(), [&](std::size_t view) {
    selected[view] = selector.Select(static_cast<int>(view), options.num_source_views);
  });
  return selected;
}

}  // namespace phi

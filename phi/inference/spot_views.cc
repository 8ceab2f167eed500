#include "phi/inference/spot_views.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "phi/geometry/depth_agreement.h"
#include "phi/inference/pooled_anchors.h"

namespace phi {
namespace {

// What a plane foretells: so far from the spot's brightness that what is as bright is unlike the spot,
constexpr float kClearlyUnlike = 2 * kMaxBrightnessChange;
// and as far so many pixels around: thin things stand before the plane, and views show them elsewhere.
constexpr int kSteadyReach = 2;
// A surface that is still sought may lie so far from where it is, relative depth; what a view measured farther off is something else.
constexpr float kOtherSurface = 0.05f;

// Where nothing should be measured but by chance: so much nearer and farther, relative depth.
constexpr float kBeside = 0.06f;

// A mean that is brighter may have pixels that were cut off at white; grey levels.
constexpr float kNearWhite = 245;

std::optional<BoxMean> MeanBelowWhite(const GrayImage& image, float u, float v) {
  const std::optional<BoxMean> mean = MeanAround(image, u, v);
  return mean && mean->value < kNearWhite ? mean : std::nullopt;
}

// q . p is the inverse depth at the image point p = (u, v, 1): 1 for the point of the plane at p, times its depth.
Eigen::Vector3d AtImagePoints(const ImagePlane& plane) { return {plane.b, plane.c, plane.a - 0.5 * (plane.b + plane.c)}; }

bool IsUnlike(float change) { return std::abs(change) > kMaxBrightnessChange; }

}  // namespace

SpotViews::SpotViews(const InferenceInput& input, std::span<const RelativeExposure> exposures)
    : calibration_(CalibrationMatrix(input.reference.view->camera.pinhole)),
      reference_(input.reference.image.get()),
      measured_(input.measured.get()),
      frame_(input.reference.view->camera.pinhole),
      own_exposure_(RelativeExposure::OfOneImage(exposures)) {
  const std::size_t num_views = std::min(input.sources.size(), input.source_depths.size());
  for (std::size_t j = 0; j < num_views; ++j) {
    const Camera &reference = input.reference.view->camera, &source = input.sources[j].view->camera;
    const MeasuredDepths* depths = input.source_depths[j].get();
    const Eigen::Vector3d center = reference.pose.rotation * (source.pose.Center() - reference.pose.Center());
    sources_.push_back({MakeRelativeView(reference, source), CalibrationMatrix(reference.pinhole) * center, input.sources[j].image.get(),
                        depths != nullptr ? depths->view() : MeasuredDepthsView(), PhotoFrame(source.pinhole), exposures[j]});
  }
}

double SpotViews::Unlike(const Spot& spot, double inverse_depth) const {
  if (!(inverse_depth >= 0)) return 1;
  const auto w = static_cast<float>(inverse_depth);
  int num_like = 0, num_unlike = 0;
  for (const Source& source : sources_) {
    const std::optional<ShownPoint> shown = Find(source, spot, w, kDepthGap);
    if (!shown) continue;
    ++(IsUnlikeThere(source, spot, *shown) ? num_unlike : num_like);
  }
  return num_unlike == 0 ? 0 : static_cast<double>(num_unlike) / (num_like + num_unlike);
}

FarSpot SpotViews::LookFar(const Spot& spot, double inverse_depth) const {
  const auto w = static_cast<float>(inverse_depth);
  FarSpot shown;
  int num_alike = 0, num_unlike = 0;
  for (const Source& source : sources_) {
    const std::optional<ShownPoint> far = Find(source, spot, 0, kDepthGap);
    if (!far) continue;
    shown.is_seen = true;
    const std::optional<ShownPoint> on_plane = Find(source, spot, w, kDepthGap);
    const bool is_alike_on_plane = on_plane && !IsUnlikeThere(source, spot, *on_plane);
    shown.is_seen_on_plane |= on_plane.has_value();
    shown.is_shown_on_plane |= is_alike_on_plane;
    if (!IsUnlikeThere(source, spot, *far)) {
      ++num_alike;
    } else if (!on_plane || is_alike_on_plane) {
      ++num_unlike;
    }
  }
  shown.is_shown = num_alike > 0;
  if (num_unlike > 0) shown.unlike = static_cast<double>(num_unlike) / (num_alike + num_unlike);
  return shown;
}

Foretold SpotViews::CountForetold(std::span<const Spot> spots, const ImagePlane& plane) const {
  Foretold foretold;
  for (const Source& source : sources_) {
    for (const Spot& spot : spots) {
      const std::optional<ShownPoint> shown = Find(source, spot, 0, kDepthGap);
      if (!shown || !ForetellsUnlike(source, spot, plane)) continue;
      ++foretold.num_unlike;
      if (IsUnlikeThere(source, spot, *shown)) ++foretold.num_seen;
    }
  }
  return foretold;
}

SpotViews::Mirrored SpotViews::CountMirrored(std::span<const AnchorCell> behind, const ImagePlane& plane) const {
  // In the reference's camera frame normal . X = 1 on the plane.
  const Eigen::Vector3d normal = calibration_.transpose() * AtImagePoints(plane);
  const Eigen::Matrix3d to_ray = calibration_.inverse();
  Mirrored mirrored;
  for (const AnchorCell& cell : behind) {
    const Eigen::Vector3d point = to_ray * Eigen::Vector3d(cell.x + 0.5, cell.y + 0.5, 1) / cell.w;
    AskMeasured(calibration_ * (point - 2 * (normal.dot(point) - 1) / normal.squaredNorm() * normal), &mirrored);
  }
  return mirrored;
}

void SpotViews::AskMeasured(const Eigen::Vector3d& point, Mirrored* mirrored) const {
  bool is_measured = false, is_behind = false, is_nearer = false, is_farther = false;
  // `p`: an image point of a view times its depth.
  const auto ask = [&](const Vec3f& p, const GrayImage& image, const auto& measured_at) {
    ShownPoint shown;
    if (!FindInImage(p, image.width(), image.height(), &shown)) return;
    const float measured = measured_at(shown.x(), shown.y());
    if (!(measured > 0)) return;
    is_measured |= DepthsAgree(measured, p.z, kDepthGap);
    is_behind |= measured > p.z;
    is_nearer |= DepthsAgree(measured, p.z / (1 + kBeside), kDepthGap);
    is_farther |= DepthsAgree(measured, p.z * (1 + kBeside), kDepthGap);
  };
  const Vec3f here = {static_cast<float>(point.x()), static_cast<float>(point.y()), static_cast<float>(point.z())};
  ask(here, *reference_, [&](int x, int y) { return MeasuredHere(x, y); });
  for (const Source& source : sources_) {
    if (!source.depths.IsKnown()) continue;
    ask(source.view.a * here + source.view.b, *source.image, [&](int x, int y) { return source.depths.Evidence(x, y); });
  }
  if (is_measured) {
    ++mirrored->num_measured;
  } else if (is_behind) {
    ++mirrored->num_seen_past;
  }
  mirrored->num_by_chance += 0.5 * (is_nearer + is_farther);
}

std::optional<BoxMean> SpotViews::MeanHere(const Spot& spot) const {
  return MeanBelowWhite(*reference_, static_cast<float>(spot.x) + 0.5f, static_cast<float>(spot.y) + 0.5f);
}

std::optional<float> SpotViews::BrightnessHere(const Spot& spot) const {
  const std::optional<BoxMean> mean = MeanHere(spot);
  if (!mean) return std::nullopt;
  return own_exposure_.Ratio(BrightSpot{}, frame_.Spot(spot.x, spot.y, mean->value)) * mean->value;
}

std::optional<ShadeOfSpot> SpotViews::ShadeIn(std::size_t index, const Spot& spot, const BoxMean& here, float w) const {
  const Source& source = sources_[index];
  const std::optional<ShownPoint> shown = Find(source, spot, w, kOtherSurface);
  if (!shown) return std::nullopt;
  const std::optional<BoxMean> there = MeanBelowWhite(*source.image, shown->u, shown->v);
  if (!there) return std::nullopt;
  const BrightSpot spot_here = frame_.Spot(spot.x, spot.y, here.value);
  const BrightSpot spot_there = source.frame.Spot(shown->x(), shown->y(), there->value);
  // The projected point moves by b with the inverse depth.
  const Vec3f& b = source.view.b;
  const float du = (b.x - shown->u * b.z) / shown->z, dv = (b.y - shown->v * b.z) / shown->z;
  return ShadeOfSpot{here.value - source.exposure.Ratio(spot_here, spot_there) * there->value,
                     -source.exposure.Slope(spot_here, spot_there) * (there->du * du + there->dv * dv)};
}

std::optional<ShownPoint> SpotViews::Find(const Source& source, const Spot& spot, float w, float gap) {
  const Vec3f p = ProjectInverseDepth(source.view, static_cast<float>(spot.x) + 0.5f, static_cast<float>(spot.y) + 0.5f, w);
  ShownPoint shown;
  if (!FindInImage(p, source.image->width(), source.image->height(), &shown)) return std::nullopt;
  const float measured = source.depths.IsKnown() ? source.depths.Evidence(shown.x(), shown.y()) : 0;
  if (measured > 0 && !DepthsAgree(shown.z, measured * w, gap)) return std::nullopt;
  return shown;
}

bool SpotViews::IsUnlikeThere(const Source& source, const Spot& spot, const ShownPoint& shown) const {
  const BrightSpot there = source.frame.Spot(shown.x(), shown.y(), static_cast<float>((*source.image)(shown.x(), shown.y())));
  return IsUnlike(source.exposure.Change(InReference(spot.x, spot.y), there));
}

bool SpotViews::IsHidden(int x, int y, float depth) const {
  const float measured = MeasuredHere(x, y);
  return measured > 0 && LiesBefore(measured, depth);
}

bool SpotViews::ForetellsUnlike(const Source& source, const Spot& spot, const ImagePlane& plane) const {
  const Eigen::Vector3d q = AtImagePoints(plane);
  const Eigen::Vector3d direction(spot.x + 0.5, spot.y + 0.5, 1);
  const double distance = (1 - q.dot(source.center)) / q.dot(direction);
  const Eigen::Vector3d p = source.center + distance * direction;
  if (!(distance > 0 && p.z() > 0)) return false;
  const double u = p.x() / p.z(), v = p.y() / p.z();
  if (!(u >= kSteadyReach && v >= kSteadyReach && u < reference_->width() - kSteadyReach && v < reference_->height() - kSteadyReach))
    return false;
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  return !IsHidden(x, y, static_cast<float>(p.z())) && IsUnlikeAround(spot, x, y);
}

bool SpotViews::IsUnlikeAround(const Spot& spot, int x, int y) const {
  for (int dy = -kSteadyReach; dy <= kSteadyReach; dy += kSteadyReach) {
    for (int dx = -kSteadyReach; dx <= kSteadyReach; dx += kSteadyReach) {
      const float change = own_exposure_.Change(InReference(spot.x, spot.y), InReference(x + dx, y + dy));
      if (!(std::abs(change) > kClearlyUnlike)) return false;
    }
  }
  return true;
}

}  // namespace phi

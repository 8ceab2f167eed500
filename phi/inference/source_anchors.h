// What a source view measured, as the reference image sees it.
#pragma once

#include <cstdint>
#include <optional>

#include "phi/backend.h"
#include "phi/geometry/device_camera.h"
#include "phi/matching/cost_aggregation.h"

namespace phi {

// Every so many pixels in each direction, `least` or more, so that no more than `most` are taken.
inline int SamplingStep(int width, int height, int least, std::int64_t most) {
  const auto num_sampled = [&](std::int64_t step) {
    return ((width + step - 1) / step) * ((height + step - 1) / step);
  };
  int step = least;
  while (num_sampled(step) > most) ++step;
  return step;
}

// (u, v) in K's coordinates.
struct SourceAnchor {
  float u, v, inverse_depth;
};

class SourceAnchors {
 public:
  // `depths` outlives this.
  SourceAnchors(const ViewImage& source, const MeasuredDepths& depths, const Camera& reference)
      : depths_(depths),
        rays_(MakeRayModel(source.view->camera.pinhole)),
        reference_from_source_(MakeRelativeView(source.view->camera, reference)) {}

  // Of the source's pixel; nullopt where it is no anchor or lies behind the reference camera.
  std::optional<SourceAnchor> At(int x, int y) const {
    if (!CarriesPlanes(depths_.states(x, y))) return std::nullopt;
    const Vec3f ray = rays_.Ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
    const RelativeView& view = reference_from_source_;
    const Vec3f point = view.rotation * (depths_.depths(x, y) * ray) + view.translation;
    if (!(point.z > 0)) return std::nullopt;
    const auto [u, v] = view.source.Project(point);
    return SourceAnchor{u, v, 1 / point.z};
  }

 private:
  const MeasuredDepths& depths_;
  RayModel rays_;
  RelativeView reference_from_source_;
};

}  // namespace phi

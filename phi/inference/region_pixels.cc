#include "phi/inference/region_pixels.h"

#include <cmath>

#include <tbb/parallel_for.h>

#include "phi/geometry/camera.h"
#include "phi/inference/plane_normal.h"
#include "phi/inference/sky_rims.h"

namespace phi {
namespace {

// Of the planes at (x, y), the inverse depth nearest to w; 0: none reaches there.
float NearestOnPlanes(const PlanesOfRegion& planes, int x, int y, float w) {
  float nearest = 0;
  for (const RegionPlane& plane : planes) {
    const float there = plane.At(x, y);
    if (there > 0 && (nearest == 0 || std::abs(there - w) < std::abs(nearest - w))) nearest = there;
  }
  return nearest;
}

void CorrectEdgeDepth(const RegionPlanes& planes, const PlanesOfRegion& of_region, int x, int y, MeasurementMap* map) {
  const float w = 1 / map->planes(x, y).depth;
  const float nearest = NearestOnPlanes(of_region, x, y, w);
  if (nearest == 0 || planes.IsWithinTolerance(x, y, w, std::abs(nearest - w))) return;
  map->planes(x, y).depth = 1 / nearest;
  map->states(x, y) = PixelState::kInferredAlone;
}

void SetNormal(const PlanesOfRegion& planes, const RayModel& rays, int x, int y, PlaneHypothesis* h) {
  for (const RegionPlane& plane : planes) {
    const float w = plane.At(x, y);
    // To the bit: a hypothesis is copied, never blended.
    if (w > 0 && h->depth == 1 / w) h->normal = NormalOfInverseDepthPlane(rays, plane.Around(x, y), x, y);
  }
}

}  // namespace

void FinishRegionPixels(const RegionPlanes& planes, const InferenceInput& input, const Rules& rules, MeasurementMap* map) {
  if (!input.keeps_measured) DropSkyRims(planes, *input.reference.image, rules, map);
  const RayModel rays = MakeRayModel(input.reference.view->camera.pinhole);
  const bool corrects = !input.keeps_measured && rules.IsOn(Rule::kEdgeDepths), sets_normals = rules.IsOn(Rule::kRegionNormals);
  tbb::parallel_for(0, map->height(), [&](int y) {
    planes.ForFittedRuns(y, [&](int begin, int end, const FittedRegion& region) {
      if (!region.planes[0].IsThere() && !region.planes[1].IsThere()) return;
      for (int x = begin; x < end; ++x) {
        if (corrects && IsMeasured(map->states(x, y))) CorrectEdgeDepth(planes, region.planes, x, y, map);
        if (sets_normals && IsInferred(map->states(x, y))) SetNormal(region.planes, rays, x, y, &map->planes(x, y));
      }
    });
  });
}

void RestoreMeasured(const MeasurementMap& measured, const StateMap& inferred, int min_num_consistent, MeasurementMap* filtered) {
  tbb::parallel_for(0, filtered->height(), [&](int y) {
    for (int x = 0; x < filtered->width(); ++x) {
      const bool was_corrected = IsInferred(inferred(x, y)) && IsMeasured(measured.states(x, y));
      const bool is_confirmed = min_num_consistent > 0 && filtered->states(x, y) != PixelState::kNone;
      if (!was_corrected || is_confirmed) continue;
      filtered->planes(x, y) = measured.planes(x, y);
      filtered->states(x, y) = PixelState::kMeasured;
    }
  });
}

}  // namespace phi

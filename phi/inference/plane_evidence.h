// What the planes of an image's regions rest on beside the image's own anchors.
#pragma once

#include <optional>
#include <vector>

#include "phi/backend.h"
#include "phi/base/rules.h"
#include "phi/geometry/depth_precision.h"
#include "phi/inference/image_plane.h"
#include "phi/inference/pooled_anchors.h"
#include "phi/inference/relative_exposure.h"
#include "phi/inference/scene_directions.h"
#include "phi/inference/source_regions.h"
#include "phi/inference/spot_views.h"
#include "phi/measurement.h"

namespace phi {

struct PlaneEvidence {
  std::vector<PooledAnchor> pooled = {};
  std::vector<ImagePlane> scene = {};
  std::optional<SceneDirections> directions = {};
  std::optional<SpotViews> views = {};
  std::vector<SourceRegions> sources = {};
  DepthPrecision precision;  // of the image's view
  ArrayView2D<const PixelState> states = {};  // of the image's own anchors; no data: all are measured
};

// Holds references to the input's images and maps. `exposures`, if not null: of each source view.
PlaneEvidence GatherPlaneEvidence(const InferenceInput& input, const Rules& rules, std::vector<RelativeExposure>* exposures = nullptr);

// What FitAgain asks: what other views' regions measured and chose, and what `choice`, the reference's own, found on its way. Holds
// references likewise.
PlaneEvidence EvidenceForChoosingAgain(const InferenceInput& input, const ViewChoice& choice, const Rules& rules);

// How far from a region's plane an anchor on it may lie.
AnchorTolerance RegionTolerance(const DepthPrecision& precision, const Rules& rules);

}  // namespace phi

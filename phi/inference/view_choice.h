// Which planes the even regions of an image take by measurements alone: what they tell the images around, which then choose again, as
// the image itself does. So all views of a wall take the same plane, and no choice confirms itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "phi/backend.h"
#include "phi/base/rules.h"
#include "phi/inference/region_fit.h"
#include "phi/inference/relative_exposure.h"
#include "phi/inference/scene_directions.h"

namespace phi {

struct ViewChoice {
  FittedRegions fitted;
  // What the choice rested on, for the next one.
  std::vector<RelativeExposure> exposures;  // of the sources
  std::optional<SceneDirections> directions;

  // Of a region of the image's ImageRegions.
  const PlanesOfRegion& PlanesOf(std::int32_t region) const {
    static constexpr PlanesOfRegion kNone{};
    const std::int32_t k = fitted.index[static_cast<std::size_t>(region)];
    return k < 0 ? kNone : fitted.regions[static_cast<std::size_t>(k)].planes;
  }

  std::size_t bytes() const;
};

// Of the reference; what its sources' regions chose is not asked. Throws as InferPlanes.
ViewChoice ChooseRegionPlanes(const InferenceInput& input, const Rules& rules);

}  // namespace phi

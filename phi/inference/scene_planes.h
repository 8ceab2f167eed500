// Planes that several surfaces carry together: of a wall, what its pictures, sockets and corners tell, in whichever view
// they were measured. A region that measures little of its wall finds the wall's plane among them.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/base/rules.h"
#include "phi/inference/anchor_cells.h"
#include "phi/inference/image_plane.h"

namespace phi {

// A plane, and the cells on it.
struct CarriedPlane : ImagePlane {
  std::vector<AnchorCell> cells;
};

// In the reference image, from what it and its source views measured in front of it, up to half an image beside it; the
// plane with most of that first. The same for any number of threads. None where the rule is off.
std::vector<CarriedPlane> FindScenePlanes(const InferenceInput& input, const AnchorTolerance& tolerance, const Rules& rules = {});

}  // namespace phi

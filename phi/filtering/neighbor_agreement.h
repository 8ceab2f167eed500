// Pixels whose measured neighbours describe another surface are not measured.
//
// Where two surfaces meet, in a crease or beside an edge, a window that sees both can match between them, in every view
// alike, so that the views confirm it. Its neighbours, each with a window of its own, do not.
#pragma once

#include "phi/geometry/device_camera.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi {

inline constexpr int kAgreementRadius = 2;  // pixels: 5 x 5 of them are asked
// A neighbour agrees when its plane, carried on to the pixel, differs from the pixel's depth by less than this.
inline constexpr float kMaxNeighborError = 0.003f;  // of the depth
// At least 2 in 5 of the neighbours with depth must agree. A bar three pixels wide stays (14 of 24 agree at its rim), one of
// two goes (9).
inline constexpr int kMinAgreeing = 2, kOutOf = 5;
// Pixels with fewer neighbours than this, half of the 24, stay: on a plain wall nobody is there to contradict, and inference
// has few other supports.
inline constexpr int kMinNeighborsAsked = 12;

// Takes the depth from the pixels that too few of their neighbours agree with, as the map was before. `rays`: the map's
// camera.
void DropContradictedPixels(const RayModel& rays, PlaneMap* map);

}  // namespace phi

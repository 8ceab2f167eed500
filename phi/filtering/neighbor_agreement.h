// Pixels are measured where their neighbours agree with them.
//
// Where two surfaces meet, in a crease or beside an edge, a window that sees both can match between them, in every view
// alike, so that the views confirm it. Its neighbours, each with a window of its own, do not. And what stands alone on a plain
// wall, a speck or the rim of something before it, is often wrong.
#pragma once

#include "phi/geometry/depth_precision.h"
#include "phi/measurement.h"

namespace phi {

inline constexpr int kAgreementRadius = 2;  // pixels: 5 x 5 of them are asked
// A neighbour agrees when its plane, carried on to the pixel, differs from the pixel's depth by less than the greater of
// these: a share of the depth, and standard deviations of what matching can tell there: about one of the difference of two
// depths, so that two in three of the right neighbours agree. By the share alone, right neighbours contradict each other
// where baselines are short.
inline constexpr float kMaxNeighborError = 0.003f, kMaxNeighborDeviations = 1.5f;
// Contradicted: at least half of the 24 neighbours have depth, and fewer than this share of those agree. A bar three pixels
// wide stays (14 of 24 agree at its rim), one of two goes (9).
inline constexpr int kMinNeighborsAsked = 12, kMinPercentAgreeing = 40;
// Doubtful: fewer than these agree, a third of all. The corner pixel of an image has as many.
inline constexpr int kMinNeighborsAgreeing = 8;

// Drops contradicted pixels and gives doubtful ones that state, judged by the map as it was. They are no measurement, but
// nothing else may show where a plain wall is, so that inference rests on them too. With few witnesses besides, a doubtful
// pixel is not even a clue, and is dropped. `precision`: of the map's view.
void JudgeByNeighbors(const DepthPrecision& precision, MeasurementMap* map);

}  // namespace phi

// The paper's literal rule (section F), per pixel: an image agrees when its own point at the pixel that the reference
// point falls on is nearer than max_depth_error times the reference depth; the merged point is the plain average.
// The paper divides by nothing that it names; depth does not depend on where the world's origin lies.
#pragma once

#include "phi/fusion/neighbor_lookup.h"

namespace phi {

struct PaperAnswer {
  bool agrees = false;
  Vec3f point;  // the neighbour's, in the reference frame
  const FusionPixel* pixel = nullptr;
};

PHI_HD PaperAnswer AskNeighborAsPaper(const FusionNeighbor& neighbor, Vec3f point, const FusionGates& gates) {
  PaperAnswer answer;
  const RelativeView& view = neighbor.view;
  const RayModel& k = view.source;
  const Vec3f x = view.rotation * point + view.translation;
  const ImagePoint seen = ProjectPoint(k, x);
  if (!InsideImage(k, x, seen)) return answer;
  const int column = static_cast<int>(seen.u), row = static_cast<int>(seen.v);
  answer.pixel = &neighbor.map(column, row);
  if (!(answer.pixel->depth > 0)) return answer;
  const Vec3f theirs = answer.pixel->depth * neighbor.Ray(column, row);
  answer.point = TransposedTimes(view.rotation, theirs - view.translation);
  answer.agrees = Norm(answer.point - point) < gates.max_depth_error * point.z;
  return answer;
}

}  // namespace phi

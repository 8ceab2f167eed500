#include "phi/filtering/neighbor_agreement.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

enum class Verdict : std::uint8_t { kMeasured, kDoubtful, kContradicted };

Verdict Judge(const RayModel& rays, const PlaneMap& map, int x, int y) {
  const float depth = map(x, y).depth;
  const Vec3f ray = rays.Ray(x + 0.5f, y + 0.5f);
  const int x0 = std::max(x - kAgreementRadius, 0), x1 = std::min(x + kAgreementRadius, map.width() - 1);
  const int y0 = std::max(y - kAgreementRadius, 0), y1 = std::min(y + kAgreementRadius, map.height() - 1);
  int num_asked = -1, num_agreeing = -1;  // the pixel itself is no neighbour, and always agrees
  for (int v = y0; v <= y1; ++v) {
    for (int u = x0; u <= x1; ++u) {
      const PlaneHypothesis& h = map(u, v);
      // h's plane is n . X = offset and meets the pixel's ray at depth offset / (n . ray).
      const float offset = h.depth * Dot(h.normal, rays.Ray(u + 0.5f, v + 0.5f));
      const float here = depth * Dot(h.normal, ray);
      const bool asked = h.depth > 0;
      num_asked += asked;
      num_agreeing += asked && std::fabs(offset - here) < kMaxNeighborError * std::fabs(here);
    }
  }
  if (num_asked >= kMinNeighborsAsked && kOutOf * num_agreeing < kMinAgreeing * num_asked)
    return Verdict::kContradicted;
  return num_agreeing < kMinNeighborsAgreeing ? Verdict::kDoubtful : Verdict::kMeasured;
}

}  // namespace

void JudgeByNeighbors(const RayModel& rays, PlaneMap* map) {
  Array2D<Verdict> verdicts(map->width(), map->height(), Verdict::kMeasured);
  tbb::parallel_for(0, map->height(), [&](int y) {
    for (int x = 0; x < map->width(); ++x) {
      if ((*map)(x, y).depth > 0) verdicts(x, y) = Judge(rays, *map, x, y);
    }
  });
  tbb::parallel_for(0, map->height(), [&](int y) {
    for (int x = 0; x < map->width(); ++x) {
      PlaneHypothesis& h = (*map)(x, y);
      if (verdicts(x, y) == Verdict::kContradicted) h = {};
      if (verdicts(x, y) == Verdict::kDoubtful) h.depth = -h.depth;
    }
  });
}

}  // namespace phi

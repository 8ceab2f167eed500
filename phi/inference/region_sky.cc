#include "phi/inference/region_sky.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "phi/inference/convex_hull.h"

namespace phi {
namespace {

constexpr std::size_t kFewForetold = 16;  // of fewer spots, what views show is chance

// Of the spots beside the cells so many are shown infinitely far away if the region is the sky; if it is not, so many of those that a
// view shows on the plane are shown alike there, and so many times as many. What cameras make of brightness leaves a wall that much.
constexpr double kMinShownSky = 0.5, kMinShownOn = 1.0 / 3, kMinOftener = 2;

// Of spots, how many are something.
struct SpotShare {
  std::size_t num_asked = 0, num_such = 0;

  void Add(bool is_such) {
    ++num_asked;
    if (is_such) ++num_such;
  }
  double Share() const { return num_asked > 0 ? static_cast<double>(num_such) / static_cast<double>(num_asked) : 0; }
};

}  // namespace

Sky RegionSky::Judge(const ImagePlane& plane, const CellsOn& cells_on) const {
  if (IsUnlikeForetold(plane)) return Sky::kSeen;
  if (spots_.empty() || !(limits_.min_unlike > 0)) return Sky::kNot;
  return LookFar(plane, cells_on());
}

// A plane moves from view to view, and its border with it: it foretells what the views show in the spots' directions. Between a
// tree and a house cells lie around the sky, which does not move. A region of one brightness that ends at things as far away as
// the plane looks the same either way.
bool RegionSky::IsUnlikeForetold(const ImagePlane& plane) const {
  if (views_ == nullptr || !(limits_.min_foretold > 0)) return false;
  const Foretold foretold = views_->CountForetold(spots_, plane);
  return foretold.num_unlike >= kFewForetold &&
         static_cast<double>(foretold.num_seen) < limits_.min_foretold * static_cast<double>(foretold.num_unlike);
}

// Of the surface that the region's spots would be on the plane, too little, by area, lies between the cells on it or moves from
// view to view, so that other views show something else in the same direction. A wall goes on between its corners and the
// skirting; the sky begins where the cells of a roof end. Then it is the sky if views show it there, and may be if they do not show
// it on the plane; what no other view shows at all is on the plane. Cells of clues alone say nothing against the sky: just above a
// roof all views match its edge, and their agreement makes clues there.
Sky RegionSky::LookFar(const ImagePlane& plane, const std::vector<AnchorCell>& on) const {
  if (on.empty()) return Sky::kNot;
  std::vector<Place> places;
  for (const AnchorCell& cell : on) {
    if (cell.is_measured) places.push_back({cell.x, cell.y});
  }
  const ConvexHull hull(std::move(places));
  double unlike_sky = 0, all = 0;
  SpotShare far_away, on_plane;  // of the spots beside the cells
  bool is_seen = false;          // any of them
  for (const Spot& spot : spots_) {
    const double w = plane.InverseDepth(spot.x, spot.y);
    if (!(w > 0)) return Sky::kSeen;  // it goes on without end
    const double area = 1 / (w * w * w);  // but for a factor that all spots share
    all += area;
    if (views_ == nullptr || hull.Contains({static_cast<double>(spot.x), static_cast<double>(spot.y)})) {
      unlike_sky += area;
      continue;
    }
    const FarSpot far = views_->LookFar(spot, w);
    unlike_sky += area * far.unlike;
    is_seen |= far.is_seen;
    far_away.Add(far.is_shown);
    if (far.is_seen_on_plane) on_plane.Add(far.is_shown_on_plane);
  }
  if (!(unlike_sky < limits_.min_unlike * all)) return Sky::kNot;
  if (far_away.Share() >= kMinShownSky) return Sky::kSeen;
  const bool is_shown = on_plane.Share() >= std::max(kMinShownOn, kMinOftener * far_away.Share());
  return is_shown || !is_seen ? Sky::kNot : Sky::kMayBe;
}

}  // namespace phi

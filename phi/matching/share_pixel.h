// Sharing of hypotheses: what the source views' estimates carry is offered to the pixels of a reference image whose own plane no source
// confirms, since where the search failed in one image it has often not failed in another. An offer is a place to look and no evidence:
// it is matched as the pixel's own plane is, and taken where it clearly matches better.
//
// In turn for each source: each of its pixels falls on one of the reference, where the nearest stays; then each pixel of the reference
// hears what fell on it. In the end each pixel chooses between its own plane and the one that a majority of the sources offers.
#pragma once

#include <bit>
#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/geometry/depth_agreement.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {

// The nearest of a source's pixels on a pixel of the reference: its depth's bits above, which order as positive floats do, and its number
// (row by row) below.
using NearestPixel = std::uint64_t;
inline constexpr NearestPixel kNoPixel = ~NearestPixel{0};

PHI_HD NearestPixel PackNearest(float depth, std::uint32_t number) {
  return NearestPixel{std::bit_cast<std::uint32_t>(depth)} << 32 | number;
}

// A source's estimate, laid on the reference.
struct OfferingSource {
  RelativeView view;  // from the source's pixels to the reference
  RayModel camera;    // of the source
  ArrayView2D<const PlaneHypothesis> planes;
};

// What a pixel was offered so far, and by how many more sources than offered another plane (Boyer and Moore's majority vote).
inline constexpr std::uint8_t kConfirmedPixel =
    0xFF;  // a source carries the pixel's own plane: nothing is offered any more
struct OffersView {
  ArrayView2D<const PlaneHypothesis> own;  // depth 0: nothing is offered
  ArrayView2D<PlaneHypothesis> offered;    // depth 0: nothing so far
  ArrayView2D<std::uint8_t> leads;

  PHI_HD bool IsSettled(int x, int y) const {
    return leads(x, y) == kConfirmedPixel || !(own(x, y).depth > 0);
  }
};

// Where the point of a source's pixel meets the reference.
struct FallenPixel {
  int x, y;
  float depth;
};

// False: nowhere.
PHI_HD bool FallOnReference(const OfferingSource& source, const RayModel& reference, int x, int y,
                            FallenPixel* fallen) {
  const float depth = source.planes(x, y).depth;
  const Vec3f at = depth * (source.view.a * Vec3f{x + 0.5f, y + 0.5f, 1.0f}) + source.view.b;  // homogeneous
  const float of_z = 1 / at.z, at_u = at.x * of_z, at_v = at.y * of_z;
  if (!(depth > 0 && at.z > 0 && at_u >= 0 && at_v >= 0 && at_u < static_cast<float>(reference.width) &&
        at_v < static_cast<float>(reference.height))) {
    return false;
  }
  *fallen = {static_cast<int>(at_u), static_cast<int>(at_v), at.z};
  return true;
}

// The plane of the source's pixel `number` as it meets the ray through the centre of reference pixel (x, y). False where that is far from
// the source pixel's point, or no hypothesis.
PHI_HD bool MeetRay(const EstimationParameters& p, const OfferingSource& source, std::uint32_t number, int x,
                    int y, PlaneHypothesis* met) {
  constexpr float kMaxShift = 0.05f;  // of depth
  const auto width = static_cast<std::uint32_t>(source.planes.width);
  const float u = static_cast<float>(number % width) + 0.5f, v = static_cast<float>(number / width) + 0.5f;
  const PlaneHypothesis& plane = source.planes.data[number];
  const Vec3f point =
      source.view.rotation * (plane.depth * source.camera.Ray(u, v)) + source.view.translation;
  const Vec3f normal = source.view.rotation * plane.normal, ray = p.reference.Ray(x + 0.5f, y + 0.5f);
  if (!FacesCamera(normal, ray)) return false;
  *met = {normal, Dot(normal, point) / Dot(normal, ray)};
  return p.IsInRange(met->depth) && DepthsAgree(point.z, met->depth, kMaxShift);
}

// nearest: of the source's pixels on (x, y).
PHI_HD void HearOffer(const EstimationParameters& p, const OfferingSource& source, NearestPixel nearest,
                      const OffersView& offers, int x, int y) {
  constexpr float kOwnPlane = 0.5f * kSameDepth;  // nearer than other views' planes are to each other
  PlaneHypothesis met;
  if (nearest == kNoPixel || !MeetRay(p, source, static_cast<std::uint32_t>(nearest), x, y, &met)) return;
  PlaneHypothesis& offered = offers.offered(x, y);
  std::uint8_t& lead = offers.leads(x, y);
  if (DepthsAgree(offers.own(x, y).depth, met.depth, kOwnPlane)) {
    offered = {};
    lead = kConfirmedPixel;
  } else if (!(offered.depth > 0)) {
    offered = met;
    lead = 1;
  } else if (DepthsAgree(offered.depth, met.depth, kSameDepth)) {
    ++lead;
  } else if (lead == 0) {
    offered = met;
    lead = 1;
  } else {
    --lead;
  }
}

// Context: as of estimate_pixel.h.
template <class Context>
PHI_HD bool MatchesClearlyBetter(const Context& context, int x, int y, const PlaneHypothesis& offered,
                                 const PlaneHypothesis& own) {
  constexpr float kMargin = 0.03f;  // of the matching cost
  const auto patch = context.LoadPatch(x, y);
  const float own_cost = context.Cost(patch, x, y, own, Samples::kAll);
  return context.Cost(patch, x, y, offered, Samples::kAll) < own_cost - kMargin;
}

// The end: what was offered gives way to what the pixel carries from now on.
template <class Context>
PHI_HD void ChoosePlane(const Context& context, const OffersView& offers, int x, int y) {
  const PlaneHypothesis own = offers.own(x, y);
  PlaneHypothesis& plane = offers.offered(x, y);
  if (!(plane.depth > 0) || !MatchesClearlyBetter(context, x, y, plane, own)) plane = own;
}

}  // namespace phi

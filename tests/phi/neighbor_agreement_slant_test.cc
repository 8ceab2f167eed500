// Neighbours on a plane so slanted that half a pixel decides: in a camera of short focal length the plane's depth changes
// by up to a fifth from pixel to pixel. Expected values come from the plane's equation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "phi/filtering/neighbor_agreement.h"
#include "phi/geometry/depth_precision.h"

namespace phi {
namespace {

constexpr int kSide = 21;
constexpr RayModel kRays{.fx = 20, .fy = 20, .cx = 10.5f, .cy = 10.5f, .width = kSide, .height = kSide};
const DepthPrecision kPrecision(kRays, {});  // no source views: the tolerance is the share of the depth

// Depth of the plane n . X = offset at pixel (x, y), whose centre is at (x + 1/2, y + 1/2).
float DepthAt(const Vec3f& n, double offset, int x, int y) {
  const double ray_x = (x + 0.5 - 10.5) / 20, ray_y = (y + 0.5 - 10.5) / 20;
  return static_cast<float>(offset / (n.x * ray_x + n.y * ray_y + n.z));
}

PlaneMap Plane(const Vec3f& n, double offset) {
  PlaneMap map(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) map(x, y) = {n, DepthAt(n, offset, x, y)};
  }
  return map;
}

StateMap Judged(const PlaneMap& planes) {
  MeasurementMap map = AllMeasured(planes);
  DropLonelyPixels(kPrecision.reference(), kPrecision.RelativeDeviations(planes), &map);
  return map.states;
}

int CountMeasured(const PlaneMap& map) {
  const StateMap states = Judged(map);
  return static_cast<int>(std::count(states.begin(), states.end(), PixelState::kMeasured));
}

// The steepest pixels see their plane at 82 degrees from its normal.
TEST(NeighborAgreementOnASlant, EveryPixelOfThePlaneStays) {
  for (const Vec3f n : {Vec3f{0.83f, 0, -0.5577634f}, Vec3f{0, 0.83f, -0.5577634f},
                        Vec3f{-0.83f, 0, -0.5577634f}, Vec3f{0, -0.83f, -0.5577634f}}) {
    EXPECT_EQ(CountMeasured(Plane(n, -2)), kSide * kSide) << n.x << ", " << n.y;
  }
}

// The limit is 0.3 % of the depth, wherever on the slant.
TEST(NeighborAgreementOnASlant, ThreeThousandthsOffThePlaneIsTheLimit) {
  const Vec3f n{0.83f, 0, -0.5577634f};
  for (const int x : {2, 10, 17}) {
    for (const float error : {-0.0028f, 0.0028f, -0.0032f, 0.0032f}) {
      PlaneMap map = Plane(n, -2);
      map(x, 9).depth *= 1 + error;
      EXPECT_EQ(Judged(map)(x, 9) == PixelState::kMeasured, std::abs(error) < 0.003f) << x << ", " << error;
    }
  }
}

// Planes of the same slant a hundredth apart have no pixel in common: the far one's holes and the near one's bar are told
// by the planes' equations alone.
TEST(NeighborAgreementOnASlant, AThinBarInFrontGoesAndAWideOneStays) {
  const Vec3f n{0.83f, 0, -0.5577634f};
  for (const int width : {1, 3}) {
    PlaneMap map = Plane(n, -2);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 9; x < 9 + width; ++x) map(x, y).depth = DepthAt(n, -1.98, x, y);
    }
    EXPECT_EQ(CountMeasured(map), kSide * (width == 1 ? kSide - 1 : kSide)) << width;
  }
}

}  // namespace
}  // namespace phi

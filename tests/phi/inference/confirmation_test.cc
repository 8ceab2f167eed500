#include "phi/inference/confirmation.h"

#include <utility>

#include <gtest/gtest.h>

#include "phi/geometry/camera.h"

namespace phi {
namespace {

// The source stands 0.5 m to the right of the reference, f = 100: a point 2 m away is 25 pixels further left there.
struct TwoCameras {
  Camera reference, source;
  RelativeView view;

  TwoCameras() {
    reference.pinhole = {120, 40, 100, 100, 60, 20};
    source = reference;
    source.pose.translation = {-0.5, 0, 0};
    view = MakeRelativeView(reference, source);
  }

  // Of the point 2 m away that the source sees at (source_u, 20.5).
  bool Confirm(const MeasuredDepths& measured, float source_u) const {
    return Confirms(view, measured.view(), source_u + 25, 20.5f, 0.5f);
  }
};

MeasuredDepths Depths(float left, float right) {
  DepthMap depths(120, 40);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 120; ++x) depths(x, y) = x < 50 ? left : right;
  }
  return AllMeasured(depths);
}

// A thing 2 m away covers the pixels left of column 50; what is behind is 4 m away.
TEST(Confirmation, ComesFromThePixelBesideASilhouetteToo) {
  const MeasuredDepths silhouette = Depths(2, 4);
  for (const float u : {48.5f, 49.9f, 50.1f, 50.6f, 50.9f}) EXPECT_TRUE(TwoCameras().Confirm(silhouette, u)) << u;
  for (const float u : {51.1f, 53.0f}) EXPECT_FALSE(TwoCameras().Confirm(silhouette, u)) << u;
}

// What is nearer hides the point; what lies beside it is not asked then.
TEST(Confirmation, DoesNotComeFromBesideSomethingNearer) {
  const MeasuredDepths nearer = Depths(2, 1);
  EXPECT_FALSE(TwoCameras().Confirm(nearer, 50.6f));
  EXPECT_TRUE(TwoCameras().Confirm(nearer, 49.9f));
}

TEST(Confirmation, HolesAroundAPixelSayNothing) {
  const MeasuredDepths behind = Depths(0, 4), alike = Depths(0, 2);
  EXPECT_FALSE(TwoCameras().Confirm(behind, 50.6f));
  EXPECT_TRUE(TwoCameras().Confirm(alike, 50.6f));
  EXPECT_FALSE(TwoCameras().Confirm(alike, 49.9f)) << "the pixel's own is a hole";
}

// 1 % is alike; from 2 % behind on the pixels around are asked, here 2 m away.
TEST(Confirmation, TolerancesAreRelative) {
  const TwoCameras cameras;
  for (const auto& [own, confirmed] : {std::pair{2.015f, true}, {2.03f, false}, {2.045f, false}, {1.985f, true}, {1.97f, false}})
    EXPECT_EQ(cameras.Confirm(Depths(own, own), 20), confirmed) << own;
  EXPECT_FALSE(cameras.Confirm(Depths(2, 2.03f), 50.6f));
  EXPECT_TRUE(cameras.Confirm(Depths(2, 2.045f), 50.6f));
}

}  // namespace
}  // namespace phi

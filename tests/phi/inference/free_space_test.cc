#include "phi/inference/free_space.h"

#include <initializer_list>

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
  PixelState State(std::initializer_list<const MeasuredDepths*> measured, float source_u) const {
    DepthEvidence evidence;
    for (const MeasuredDepths* depths : measured) {
      AddEvidence(view, depths->view(), source_u + 25, 20.5f, 0.5f, &evidence);
    }
    return evidence.State();
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
TEST(FreeSpace, APixelBesideASilhouetteIsNotSeenThrough) {
  const MeasuredDepths silhouette = Depths(2, 4);
  for (const float u : {48.5f, 49.9f, 50.1f, 50.6f, 50.9f}) {
    EXPECT_EQ(TwoCameras().State({&silhouette}, u), PixelState::kInferredConfirmed) << u;
  }
  for (const float u : {51.1f, 53.0f})
    EXPECT_EQ(TwoCameras().State({&silhouette}, u), PixelState::kNone) << u;
}

// What is there is hidden, whatever the background beside says.
TEST(FreeSpace, APixelBesideSomethingNearerIsNotSeenThrough) {
  const MeasuredDepths silhouette = Depths(1, 4);
  EXPECT_EQ(TwoCameras().State({&silhouette}, 50.6f), PixelState::kInferredAlone);
  EXPECT_EQ(TwoCameras().State({&silhouette}, 51.1f), PixelState::kNone);
}

// Pixels without depth beside it say nothing: the pixel's own measurement stands.
TEST(FreeSpace, HolesAroundAPixelSayNothing) {
  const MeasuredDepths behind = Depths(0, 4), alike = Depths(0, 2);
  EXPECT_EQ(TwoCameras().State({&behind}, 50.6f), PixelState::kNone);
  EXPECT_EQ(TwoCameras().State({&alike}, 50.6f), PixelState::kInferredConfirmed);
  EXPECT_EQ(TwoCameras().State({&alike}, 49.9f), PixelState::kInferredAlone);
}

TEST(FreeSpace, OneViewDoesNotOutweighOthers) {
  const MeasuredDepths behind = Depths(4, 4), alike = Depths(2, 2), nearer = Depths(1, 1);
  const TwoCameras cameras;
  EXPECT_EQ(cameras.State({&behind, &alike, &alike}, 20), PixelState::kInferredConfirmed);
  EXPECT_EQ(cameras.State({&alike, &behind}, 20), PixelState::kInferredConfirmed);
  EXPECT_EQ(cameras.State({&behind, &alike, &behind}, 20), PixelState::kNone);
  EXPECT_EQ(cameras.State({&behind, &nearer}, 20), PixelState::kNone);  // which says nothing of what it hides
}

// 2 % behind is behind, 1 % is alike.
TEST(FreeSpace, TolerancesAreRelative) {
  const TwoCameras cameras;
  const MeasuredDepths behind = Depths(2.045f, 2.045f), between = Depths(2.03f, 2.03f),
                       alike = Depths(2.015f, 2.015f);
  EXPECT_EQ(cameras.State({&behind}, 20), PixelState::kNone);
  EXPECT_EQ(cameras.State({&between}, 20), PixelState::kInferredAlone);
  EXPECT_EQ(cameras.State({&alike}, 20), PixelState::kInferredConfirmed);
}

}  // namespace
}  // namespace phi

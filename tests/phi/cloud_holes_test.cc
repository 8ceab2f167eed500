// Which pixels of an image lie in holes of the cloud, marked by hand, and which points fusion puts there.
#include "phi/fusion/cloud_holes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "phi/fusion/image_fusion.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/scene_fusers.h"

namespace phi {
namespace {

using test_support::MakeFuser;
using test_support::MakeMaps;
using test_support::PlaneScene;
using test_support::RenderedScene;

constexpr PixelOutcome kOpen = PixelOutcome::kNormal;

std::string Row(const Array2D<PixelOutcome>& outcomes, int y) {
  std::string row;
  for (const char hole : FindHoles(outcomes, y)) row += hole != 0 ? '#' : '.';
  return row;
}

TEST(CloudHoles, EndThreePixelsFromPoints) {
  Array2D<PixelOutcome> outcomes(12, 9, kOpen);
  outcomes(4, 4) = PixelOutcome::kFused;
  EXPECT_EQ(Row(outcomes, 4), "#.......####");
  EXPECT_EQ(Row(outcomes, 1), "#.......####");
  EXPECT_EQ(Row(outcomes, 7), "#.......####");
  EXPECT_EQ(Row(outcomes, 0), "############");
  EXPECT_EQ(Row(outcomes, 8), "############");
  outcomes(4, 4) = kOpen;
  outcomes(11, 4) = PixelOutcome::kCovered;
  EXPECT_EQ(Row(outcomes, 4), "########....");
  outcomes(0, 0) = PixelOutcome::kFused;
  EXPECT_EQ(Row(outcomes, 3), "....####....");
}

TEST(CloudHoles, HoldOnlyPixelsThatNormalsStandAgainst) {
  Array2D<PixelOutcome> outcomes(6, 1, kOpen);
  outcomes(1, 0) = PixelOutcome::kNoDepth;
  outcomes(2, 0) = PixelOutcome::kOutsideBox;
  outcomes(3, 0) = PixelOutcome::kDepth;
  EXPECT_EQ(Row(outcomes, 0), "#...##");
}

TEST(CloudHoles, ImagesNarrowerThanTheEdge) {
  for (int width = 1; width <= 4; ++width) {
    for (int at = 0; at < width; ++at) {
      Array2D<PixelOutcome> outcomes(width, 2, kOpen);
      outcomes(at, 0) = PixelOutcome::kFused;
      EXPECT_EQ(Row(outcomes, 1), std::string(static_cast<std::size_t>(width), '.')) << width << " " << at;
    }
    const Array2D<PixelOutcome> none(width, 2, kOpen);
    EXPECT_EQ(Row(none, 1), std::string(static_cast<std::size_t>(width), '#'));
  }
}

// The plane z = 4 seen by two images whose normals differ by 20 degrees in a square of the first's pixels, up to
// `wrong` from its middle.
class PointsInHoles : public ::testing::Test {
 protected:
  void Fuse(int wrong, FusionOptions options = {}) {
    const RenderedScene scene = PlaneScene({.num_views = 2}, {0, 0, -1});
    maps_ = MakeMaps(scene);
    const float angle = static_cast<float>(20 * M_PI / 180);
    for (int y = kY - wrong; y <= kY + wrong; ++y) {
      for (int x = kX - wrong; x <= kX + wrong; ++x)
        maps_[0](x, y).normal = PackNormal({std::sin(angle), 0, -std::cos(angle)});
    }
    ImageFuser fuser = MakeFuser(scene, 0, options, &maps_);
    outcomes_ = fuser.FuseRows(0, maps_[0].height()).outcomes;
    num_refused_ = outcomes_[PixelOutcome::kNormal];
    const FusedBlock holes = fuser.FillHoles(0, maps_[0].height());
    outcomes_ += holes.outcomes;
    num_filled_ = static_cast<int>(holes.points.size());
  }
  bool HasPoint(int x, int y) const { return (maps_[0](x, y).flags & FusionPixel::kEmitted) != 0; }

  static constexpr int kX = 80, kY = 60;
  std::vector<FusionMap> maps_;
  OutcomeCounts outcomes_;
  std::int64_t num_refused_ = 0;
  int num_filled_ = 0;
};

TEST_F(PointsInHoles, TakeNormalsThatDifferMoreFourPixelsFromPoints) {
  Fuse(6);  // 13 x 13 pixels, of which 7 x 7 are more than 3 pixels from those outside
  EXPECT_EQ(num_refused_, 13 * 13);
  EXPECT_EQ(num_filled_, 7 * 7);
  EXPECT_TRUE(HasPoint(kX, kY));
  EXPECT_TRUE(HasPoint(kX - 3, kY + 3));
  EXPECT_FALSE(HasPoint(kX - 4, kY));
  EXPECT_FALSE(HasPoint(kX, kY + 4));
  EXPECT_EQ(outcomes_[PixelOutcome::kNormal], 13 * 13 - 7 * 7);
}

TEST_F(PointsInHoles, SmallOnesStayAsTheyAre) {
  Fuse(2);
  EXPECT_EQ(num_refused_, 5 * 5);
  EXPECT_EQ(num_filled_, 0);
}

TEST_F(PointsInHoles, TakeNoNormalsBeyondTheirLimit) {
  FusionOptions options;
  options.max_normal_error_in_holes = 19;
  Fuse(6, options);
  EXPECT_EQ(num_refused_, 13 * 13);
  EXPECT_EQ(num_filled_, 0);
  options.max_normal_error_in_holes = 21;
  Fuse(6, options);
  EXPECT_EQ(num_filled_, 7 * 7);
  options.max_normal_error_in_holes = 0;  // then max_normal_error holds there too
  Fuse(6, options);
  EXPECT_EQ(num_filled_, 0);
}

}  // namespace
}  // namespace phi

// Pictures and statistics of small maps whose values are written down here.
#include "colmap_ext/colorize.h"

#include <limits>

#include <gtest/gtest.h>

#include "colmap_ext/map_statistics.h"

namespace {

using colmap_ext::Rgb;
using phi::Array2D;
using phi::Vec3f;

TEST(Colorize, RobustRangeLeavesOutliersAndInvalidPixelsOut) {
  Array2D<float> depth(100, 10, 0.0f);
  for (int i = 0; i < 990; ++i) depth.data()[i] = 2.0f + 0.001f * static_cast<float>(i % 500);
  depth.data()[990] = 1e6f;
  depth.data()[991] = std::numeric_limits<float>::quiet_NaN();
  depth.data()[992] = -5;
  const colmap_ext::ValueRange range = colmap_ext::RobustRange(depth);
  EXPECT_NEAR(range.low, 2.01f, 0.005f);
  EXPECT_NEAR(range.high, 2.49f, 0.005f);
}

TEST(Colorize, DepthIsWarmNearColdFarAndBlackWhereInvalid) {
  Array2D<float> depth(3, 1, 0.0f);
  depth(0, 0) = 1.3f;
  depth(1, 0) = 3.7f;
  const auto picture = colmap_ext::ColorizeDepth(depth, {1, 4});
  EXPECT_GT(picture(0, 0)[0], picture(0, 0)[2]) << "near: more red than blue";
  EXPECT_LT(picture(1, 0)[0], picture(1, 0)[2]) << "far: more blue than red";
  EXPECT_EQ(picture(2, 0), (Rgb{0, 0, 0}));
}

TEST(Colorize, NormalsMapTheirAxesToColours) {
  Array2D<Vec3f> normals(4, 1);
  normals(0, 0) = {0, 0, -1};  // towards the camera
  normals(1, 0) = {1, 0, 0};   // right
  normals(2, 0) = {0, -1, 0};  // up
  const auto picture = colmap_ext::ColorizeNormals(normals);
  EXPECT_EQ(picture(0, 0), (Rgb{128, 128, 255}));
  EXPECT_EQ(picture(1, 0), (Rgb{255, 128, 128}));
  EXPECT_EQ(picture(2, 0), (Rgb{128, 255, 128}));
  EXPECT_EQ(picture(3, 0), (Rgb{0, 0, 0}));
}

TEST(Colorize, CostGrowsBrighter) {
  Array2D<float> cost(3, 1, std::numeric_limits<float>::quiet_NaN());
  cost(0, 0) = 0.1f;
  cost(1, 0) = 1.9f;
  const auto picture = colmap_ext::ColorizeCost(cost);
  EXPECT_LT(picture(0, 0)[1], picture(1, 0)[1]);
  EXPECT_EQ(picture(2, 0), (Rgb{0, 0, 0}));
}

TEST(Colorize, ConfidenceIsBrightWhereSureAndBlackWhereThereIsNone) {
  Array2D<float> confidence(3, 1, 0.0f);
  confidence(0, 0) = 0.1f;
  confidence(1, 0) = 0.9f;
  const auto picture = colmap_ext::ColorizeConfidence(confidence);
  EXPECT_LT(picture(0, 0)[1], picture(1, 0)[1]);
  EXPECT_EQ(picture(2, 0), (Rgb{0, 0, 0}));
}

TEST(Colorize, SideBySideKeepsBothPictures) {
  const colmap_ext::ColorImage left(2, 1, Rgb{1, 2, 3}), right(3, 1, Rgb{4, 5, 6});
  const auto both = colmap_ext::SideBySide(left, right);
  EXPECT_EQ(both(0, 0), (Rgb{1, 2, 3}));
  EXPECT_EQ(both(2, 0), (Rgb{255, 255, 255}));
  EXPECT_EQ(both(both.width() - 1, 0), (Rgb{4, 5, 6}));
}

TEST(MapStatistics, DepthAccuracyCountsKeptAndAccuratePixels) {
  Array2D<float> truth(5, 1, 2.0f), depth(5, 1, 2.0f);
  truth(0, 0) = 0;       // no truth: does not count
  depth(1, 0) = 0;       // not kept
  depth(2, 0) = 2.019f;  // 0.95 % off
  depth(3, 0) = 1.975f;  // 1.25 % off
  const auto accuracy = colmap_ext::CompareDepth(depth, truth, 0.01);
  EXPECT_EQ(accuracy.num_truth, 4);
  EXPECT_EQ(accuracy.num_kept, 3);
  EXPECT_EQ(accuracy.num_within, 2);
  EXPECT_DOUBLE_EQ(accuracy.KeptPercent(), 75);
  EXPECT_NEAR(accuracy.WithinPercent(), 66.667, 0.001);
}

TEST(MapStatistics, TruthOfTwiceTheSizeIsReadAtTheNearestPixel) {
  Array2D<float> truth(4, 2, 1.0f), depth(2, 1, 1.0f);
  truth(3, 1) = 5;  // the middle of the second pixel is the corner of four: the lower right one is taken
  EXPECT_EQ(colmap_ext::CompareDepth(depth, truth, 0.01).num_within, 1);
}

TEST(MapStatistics, NormalsAreComparedByAngle) {
  Array2D<Vec3f> truth(3, 1, Vec3f{0, 0, -1}), normals(3, 1);
  normals(0, 0) = {0.1736482f, 0, -0.9848078f};  // 10 degrees
  normals(1, 0) = {0.1564345f, 0, -0.9876883f};  // 9 degrees
  const auto accuracy = colmap_ext::CompareNormals(normals, truth, 9.5);
  EXPECT_EQ(accuracy.num_kept, 2);
  EXPECT_EQ(accuracy.num_within, 1);
  EXPECT_NEAR(colmap_ext::NormalStatistics(normals).low, 9, 0.01);
}

TEST(MapStatistics, DepthPercentilesAreOfValidPixels) {
  Array2D<float> depth(102, 1, -1.0f);
  for (int i = 0; i <= 100; ++i) depth(i, 0) = static_cast<float>(1 + i * 37 % 101);
  const auto statistics = colmap_ext::DepthStatistics(depth);
  EXPECT_EQ(statistics.num_valid, 101);
  EXPECT_FLOAT_EQ(statistics.low, 3);
  EXPECT_FLOAT_EQ(statistics.median, 51);
  EXPECT_FLOAT_EQ(statistics.high, 99);
}

}  // namespace

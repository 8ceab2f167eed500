#include "phi/inference/region_planes.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "phi/inference/hypotheses.h"
#include "phi/inference/infer.h"
#include "tests/support/centered_view.h"
#include "tests/support/region_hypotheses.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

constexpr int kWidth = 160, kHeight = 120;

float LeftWall(int x, int y) { return 0.3f + 0.002f * x - 0.0005f * y; }
float RightWall(int x, int) { return 0.46f - 0.001f * (x - 80); }  // meets the left wall near x = 80
float Walls(int x, int y) { return x < 80 ? LeftWall(x, y) : RightWall(x, y); }

// Measured on a rim 8 pixels wide; the inside is a hole.
bool OnRim(int x, int y) { return x < 8 || y < 8 || x >= kWidth - 8 || y >= kHeight - 8; }

template <typename InverseDepth>
PlaneMap RimOf(const InverseDepth& inverse_depth) {
  PlaneMap map(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      map(x, y).normal = {0, 0, -1};
      map(x, y).depth = OnRim(x, y) ? 1 / inverse_depth(x, y) : 0;
    }
  }
  return map;
}

// Nearest of the hypotheses to the truth, as an error relative to it; large where there is none.
float BestError(const Hypotheses& hypotheses, int x, int y, float truth) {
  float best = 1e9f;
  for (const auto& map : hypotheses.state().maps.inverse_depth) {
    if (map(x, y) > 0) best = std::fmin(best, std::fabs(map(x, y) - truth) / truth);
  }
  return best;
}

// A plain image's, from anchors of the given inverse depths; 0: none.
template <typename InverseDepth>
RegionPlanes PlanesThrough(const InverseDepth& inverse_depth, const DepthPrecision& precision = {}) {
  Array2D<float> anchors(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) anchors(x, y) = inverse_depth(x, y);
  }
  return RegionPlanes(SharedRegions(GrayImage(kWidth, kHeight, 120)), std::as_const(anchors).view(), 3,
                      {.pooled = {}, .scene = {}, .precision = precision});
}

// A wall whose anchors err by 0.8 % from pixel to pixel, to and fro: far more than 0.3 %. A match of 0.15 pixels with a
// baseline of a hundredth of the depth tells no more.
TEST(RegionPlanes, AnchorsMayErrByWhatMatchingCanTell) {
  const auto noisy = [](int x, int y) { return LeftWall(x, y) * ((x + y) % 2 == 0 ? 1.008f : 0.992f); };
  const auto on_wall = [](const RegionPlanes& planes) {
    return std::fabs(planes.At(20, 20)[0].At(20, 20) / LeftWall(20, 20) - 1);
  };
  Camera reference;
  reference.pinhole = {kWidth, kHeight, 500, 500, kWidth / 2.0, kHeight / 2.0};
  Camera source = reference;
  source.pose.translation = {-0.01 / LeftWall(20, 20), 0, 0};
  const DepthPrecision precision(reference, {&source});
  EXPECT_GT(on_wall(PlanesThrough(noisy)), 0.006f);
  EXPECT_LT(on_wall(PlanesThrough(noisy, precision)), 0.002f);
}

TEST(RegionPlanes, ARegionWithOneSurfaceGetsItsPlane) {
  const GrayImage plain(kWidth, kHeight, 120);
  const Hypotheses hypotheses = RegionHypotheses(AllMeasured(RimOf(LeftWall)), Rules(), plain, SharedRegions(plain));
  for (int y = 8; y < kHeight - 8; ++y) {
    for (int x = 8; x < kWidth - 8; ++x) {
      EXPECT_NEAR(hypotheses.state().maps.inverse_depth[kDescending](x, y), LeftWall(x, y), 1e-5f);
    }
  }
}

TEST(RegionPlanes, ARegionWithTwoSurfacesGetsBoth) {
  const GrayImage plain(kWidth, kHeight, 120);
  const Hypotheses hypotheses = RegionHypotheses(AllMeasured(RimOf(Walls)), Rules(), plain, SharedRegions(plain));
  for (int y = 20; y < kHeight - 20; y += 5) {
    for (const int x : {20, 40, 60, 100, 120, 140}) {
      EXPECT_LT(BestError(hypotheses, x, y, Walls(x, y)), 0.003f) << x << ", " << y;
    }
  }
}

TEST(RegionPlanes, NoiseOfTheAnchorsIsNoSecondSurface) {
  // A fifth of the anchors lies 1 % too far away; at 3 % it is another surface.
  for (const float error : {0.01f, 0.03f}) {
    const RegionPlanes planes = PlanesThrough([&](int x, int y) {
      return OnRim(x, y) ? LeftWall(x, y) / (1 + ((x + y) % 5 == 0 ? error : 0)) : 0;
    });
    EXPECT_NEAR(planes.At(60, 60)[0].At(60, 60), LeftWall(60, 60), 1e-5f);
    const float second = error > 0.02f ? LeftWall(60, 60) / (1 + error) : 0;
    EXPECT_NEAR(planes.At(60, 60)[1].At(60, 60), second, 1e-5f) << error;
  }
}

// A vase stands before the wall: along its outline, a tenth of the picture away from the wall's rim, windows match the vase. In
// front of the wall it is no second surface of the region; behind it, through an opening, it is one.
TEST(RegionPlanes, AThingBeforeTheWallIsNoSurfaceOfIt) {
  for (const float closer : {1.1f, 0.9f}) {
    const RegionPlanes planes = PlanesThrough([&](int x, int y) {
      if (x >= 70 && x < 90 && y >= 40 && y < 80) return closer * LeftWall(x, y);
      return OnRim(x, y) ? LeftWall(x, y) : 0;
    });
    EXPECT_NEAR(planes.At(60, 60)[0].At(60, 60), LeftWall(60, 60), 1e-5f);
    EXPECT_NEAR(planes.At(60, 60)[1].At(60, 60), closer > 1 ? 0 : closer * LeftWall(60, 60), 1e-5f);
  }
}

TEST(RegionPlanes, AnImageEdgeEndsARegion) {
  // Dark left half with a measured rim, bright right half without any measurement.
  GrayImage image(kWidth, kHeight, 60);
  PlaneMap map = RimOf(LeftWall);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 80; x < kWidth; ++x) {
      image(x, y) = 180;
      map(x, y).depth = 0;
    }
  }
  const Hypotheses hypotheses = RegionHypotheses(AllMeasured(map), Rules(), image, SharedRegions(image));
  EXPECT_GT(hypotheses.state().maps.inverse_depth[kDescending](60, 60), 0);
  for (int x = 84; x < kWidth; ++x) {  // a region reaches three pixels beyond its inside
    for (int k = 0; k < kNumDirections; ++k)
      EXPECT_EQ(hypotheses.state().maps.inverse_depth[k](x, 60), 0) << x;
  }
}

TEST(RegionPlanes, PlanesStayNearWhatCarriesThem) {
  const GrayImage plain(kWidth, kHeight, 120);
  PlaneMap map = RimOf(LeftWall);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) map(x, y).depth = x < 40 && y < 40 ? 1 / LeftWall(x, y) : 0;
  }
  // Uniform over 40 pixels, standard deviation 40 / sqrt(12) = 11.5 in both directions: the plane reaches 58 pixels from
  // the middle, (19.5, 19.5).
  const Hypotheses hypotheses = RegionHypotheses(AllMeasured(map), Rules(), plain, SharedRegions(plain));
  EXPECT_GT(hypotheses.state().maps.inverse_depth[kDescending](58, 58), 0);
  for (int k = 0; k < kNumDirections; ++k) EXPECT_EQ(hypotheses.state().maps.inverse_depth[k](63, 63), 0);
}

// A roof's rim before an even sky: 16 rows carry a plane, standard deviation 16 / sqrt(12) = 4.6, that reaches 23 rows from
// their middle. (The plane fit's window makes anchors of up to three rows beside them; lines reach 12 rows.)
TEST(RegionPlanes, ARimDoesNotCarryAPlaneFarAcrossItself) {
  const GrayImage sky(kWidth, kHeight, 180);
  PlaneMap map = RimOf(LeftWall);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) map(x, y).depth = y >= kHeight - 16 ? 1 / LeftWall(x, y) : 0;
  }
  const Hypotheses hypotheses = RegionHypotheses(AllMeasured(map), Rules(), sky, SharedRegions(sky));
  EXPECT_GT(hypotheses.state().maps.inverse_depth[kDescending](80, kHeight - 16 - 8), 0);
  for (int k = 0; k < kNumDirections; ++k) {
    EXPECT_EQ(hypotheses.state().maps.inverse_depth[k](80, kHeight - 16 - 20), 0);
  }
}

TEST(RegionPlanes, LargeRegionsGetTheSamePlanesFromAnyNumberOfThreads) {
  // 720 x 600 pixels: far more anchors than a plane is fitted to.
  const int width = 720, height = 600;
  const auto inverse_depth = [](int x, int y) {
    const float noise = 0.001f * static_cast<float>((x * 7 + y * 13) % 11 - 5);
    return (0.3f + 0.0003f * x - 0.0001f * y) * (1 + noise);
  };
  Array2D<float> anchors(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (x < 300 || x >= 500) anchors(x, y) = inverse_depth(x, y);
    }
  }
  const GrayImage plain(width, height, 120);
  const RegionPlanes many(SharedRegions(plain), std::as_const(anchors).view(), 3);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const RegionPlanes alone(SharedRegions(plain), std::as_const(anchors).view(), 3);
  for (int y = 0; y < height; y += 7) {
    for (int x = 0; x < width; x += 7) {
      const float truth = 0.3f + 0.0003f * x - 0.0001f * y;
      EXPECT_NEAR(many.At(x, y)[0].At(x, y), truth, 0.001f * truth) << x << ", " << y;
      EXPECT_EQ(many.At(x, y)[0].At(x, y), alone.At(x, y)[0].At(x, y)) << x << ", " << y;
    }
  }
}

TEST(RegionPlanes, OverexposedHolesStayHoles) {
  const auto flat = [](int, int) { return 0.4f; };
  GrayImage image(kWidth, kHeight, 120);
  for (int y = 50; y < 70; ++y) {
    for (int x = 50; x < 70; ++x) image(x, y) = 255;
  }
  const Hypotheses hypotheses = RegionHypotheses(AllMeasured(RimOf(flat)), Rules(), image, SharedRegions(image));
  for (int k = 0; k < kNumDirections; ++k) {
    EXPECT_EQ(hypotheses.state().maps.inverse_depth[k](60, 60), 0);
    EXPECT_GT(hypotheses.state().maps.inverse_depth[k](40, 60), 0);
  }
  Rules rules;
  rules.Set(Rule::kOverexposed, 0);
  const Hypotheses filled = RegionHypotheses(AllMeasured(RimOf(flat)), rules, image, SharedRegions(image));
  EXPECT_GT(filled.state().maps.inverse_depth[kHorizontal](60, 60), 0);
}

// The left wall's rim, without other views, in an image of one brightness.
InferenceInput RimAlone(std::uint8_t brightness) {
  static const SceneView view = test_support::CenteredView(1, kWidth, kHeight, 100);
  InferenceInput input;
  input.reference = {&view, std::make_shared<const GrayImage>(kWidth, kHeight, brightness)};
  input.measured = std::make_shared<const MeasurementMap>(AllMeasured(RimOf(LeftWall)));
  return input;
}

// An overexposed image, whose holes stay where regions are asked.
TEST(RegionPlanes, PaperFormulasHaveNone) {
  const InferenceInput input = RimAlone(255);
  InferenceOptions options;
  options.mode = InferenceMode::kMinCost;
  EXPECT_FALSE(IsInferred(InferPlanes(input, StereoOptions(), options).map.states(60, 60)));
  options.method.formulas = Formulas::kPaper;
  const MeasurementMap filled = InferPlanes(input, StereoOptions(), options).map;
  EXPECT_TRUE(IsInferred(filled.states(60, 60)));
  const Hypotheses lines(AllMeasured(RimOf(LeftWall)), Formulas::kPaper);
  const float w = 1 / filled.planes(60, 60).depth;
  bool is_line = false;
  for (int k = 0; k < kNumDirections; ++k) {
    is_line = is_line || std::abs(lines.state().maps.inverse_depth[k](60, 60) - w) <= 1e-6f * w;
  }
  EXPECT_TRUE(is_line);
}

// Who runs many images keeps their regions. Without any the hole stays open.
TEST(RegionPlanes, GivenRegionsAreTaken) {
  InferenceInput input = RimAlone(120);
  InferenceOptions options;
  options.mode = InferenceMode::kMinCost;
  const MeasurementMap found = InferPlanes(input, StereoOptions(), options).map;
  input.regions = SharedRegions(*input.reference.image);
  const MeasurementMap given = InferPlanes(input, StereoOptions(), options).map;
  EXPECT_TRUE(std::equal(found.states.begin(), found.states.end(), given.states.begin()));
  for (const int x : {20, 60, 140}) EXPECT_EQ(found.planes(x, 60).depth, given.planes(x, 60).depth);
  EXPECT_NEAR(1 / given.planes(60, 60).depth, LeftWall(60, 60), 1e-5);
  input.regions = std::make_shared<const ImageRegions>(ImageRegions{Array2D<std::int32_t>(kWidth, kHeight, -1), 0});
  const MeasurementMap without = InferPlanes(input, StereoOptions(), options).map;
  EXPECT_FALSE(IsInferred(without.states(60, 60)));
}

}  // namespace
}  // namespace phi

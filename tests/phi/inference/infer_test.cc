#include "phi/inference/infer.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "phi/filtering/filled_value.h"

namespace phi {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 150;

// A wall seen obliquely, 2 m to 4 m away: n . X = n . (0, 0, 3), n tilted by 30 degrees about the vertical axis.
struct Wall {
  Vec3f normal{0.5f, 0, -0.8660254f};

  // From a camera that stands `shift` m to the right of the reference camera: n . X = n . (-shift, 0, 3) there.
  double InverseDepth(int x, int y, double shift = 0) const {
    const double u = (x + 0.5 - kWidth / 2.0) / kFocal, v = (y + 0.5 - kHeight / 2.0) / kFocal;
    return (normal.x * u + normal.y * v + normal.z) / (3.0 * normal.z - shift * normal.x);
  }
};

SceneView MakeView(const char* name, double baseline) {
  SceneView view;
  view.name = name;
  view.camera.pinhole = {kWidth, kHeight, kFocal, kFocal, kWidth / 2.0, kHeight / 2.0};
  view.camera.pose.translation = {-baseline, 0, 0};
  return view;
}

// A featureless wall: the images are plain, only the measured surroundings tell the depth.
struct PlainScene {
  SceneView reference = MakeView("reference", 0), source = MakeView("source", 0.5);
  std::shared_ptr<const GrayImage> plain = std::make_shared<GrayImage>(kWidth, kHeight, std::uint8_t{128});

  InferenceInput Input(const PlaneMap& measured) const {
    InferenceInput input;
    input.reference = {&reference, plain};
    input.sources = {{&source, plain}};
    input.measured = std::make_shared<PlaneMap>(measured);
    return input;
  }
};

bool InHole(int x, int y) { return x >= 50 && x < 110 && y >= 40 && y < 80; }

// disparity_noise: standard deviation in pixels for a baseline of 0.5 m.
PlaneMap MakeMeasured(double disparity_noise) {
  const Wall wall;
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, disparity_noise);
  PlaneMap map(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (InHole(x, y)) continue;
      // disparity = focal * baseline / depth
      const double w = wall.InverseDepth(x, y) + (disparity_noise > 0 ? noise(random) : 0) / (kFocal * 0.5);
      map(x, y).normal = wall.normal;
      map(x, y).depth = static_cast<float>(1 / w);
    }
  }
  return map;
}

// What the source view of PlainScene measured: the wall `factor` times as far as it is.
std::shared_ptr<const DepthMap> SourceDepths(double factor) {
  auto depths = std::make_shared<DepthMap>(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      (*depths)(x, y) = static_cast<float>(factor / Wall().InverseDepth(x, y, 0.5));
    }
  }
  return depths;
}

std::int64_t NumFilled(const InferenceResult& result, int value = -1) {
  return std::count_if(result.filled.begin(), result.filled.end(),
                       [&](std::uint8_t v) { return value < 0 ? v != 0 : v == value; });
}

bool SameBits(const PlaneHypothesis& a, const PlaneHypothesis& b) {
  return a.depth == b.depth && a.normal.x == b.normal.x && a.normal.y == b.normal.y &&
         a.normal.z == b.normal.z;
}

// All that is not measured is inferred on the wall; what is measured stays.
void ExpectTheWholeWall(const PlaneMap& measured) {
  const Wall wall;
  for (const InferenceMode mode : {InferenceMode::kMinCost, InferenceMode::kMrf}) {
    InferenceOptions options;
    options.mode = mode;
    const InferenceResult result = InferPlanes(PlainScene().Input(measured), StereoOptions(), options);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const bool is_measured = measured(x, y).depth > 0;
        ASSERT_EQ(result.filled(x, y), is_measured ? kMeasuredPixel : kInferredAlone) << x << ", " << y;
        ASSERT_NEAR(result.map(x, y).depth * wall.InverseDepth(x, y), 1, 3e-6) << x << ", " << y;
        ASSERT_TRUE(!is_measured || SameBits(result.map(x, y), measured(x, y)));
        EXPECT_GT(Dot(result.map(x, y).normal, wall.normal), 1 - 1e-5f);
      }
    }
  }
}

TEST(Infer, APlaneWithAHoleComesBack) {
  const PlaneMap measured = MakeMeasured(0);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) ASSERT_EQ(measured(x, y).depth > 0, !InHole(x, y));
  }
  ExpectTheWholeWall(measured);
}

// The left third is doubtful: it comes back on the wall, as inferred depth. A doubtful speck 10 % before the wall does too.
TEST(Infer, DoubtfulPixelsCarryTheWallAndAreInferred) {
  PlaneMap measured = MakeMeasured(0);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 50; ++x) measured(x, y).depth *= -1;
  }
  measured(140, 20).depth *= -0.9f;
  ExpectTheWholeWall(measured);
}

TEST(Infer, ADoubtfulPixelWithoutAHypothesisIsAHole) {
  PlaneMap measured(kWidth, kHeight);
  measured(80, 60) = {{0, 0, -1}, -3};
  const InferenceResult result =
      InferPlanes(PlainScene().Input(measured), StereoOptions(), InferenceOptions());
  EXPECT_EQ(result.map(80, 60).depth, 0);
  EXPECT_EQ(result.map(80, 60).normal.z, 0);
  EXPECT_EQ(NumFilled(result), 0);
}

// In the paper's form they are holes.
TEST(Infer, DoubtfulPixelsSupportNothingInThePapersForm) {
  PlaneMap measured = MakeMeasured(0);
  for (PlaneHypothesis& h : measured) h.depth *= -1;
  InferenceOptions options;
  options.formulas = Formulas::kPaper;
  EXPECT_EQ(NumFilled(InferPlanes(PlainScene().Input(measured), StereoOptions(), options)), 0);
}

TEST(Infer, NormalsOfFilledPixelsWithstandNoise) {
  const InferenceResult result = InferPlanes(PlainScene().Input(MakeMeasured(0.1)), StereoOptions(), {});
  int filled = 0, close = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (result.filled(x, y) == 0) continue;
      ++filled;
      EXPECT_NEAR(Norm(result.map(x, y).normal), 1, 1e-5f);
      close += Dot(result.map(x, y).normal, Wall().normal) > std::cos(10 * M_PI / 180);
    }
  }
  EXPECT_EQ(filled, 60 * 40);
  EXPECT_GE(close, 0.95 * filled);
}

// The hole takes the plane of the whole plain wall, and its normal up to the rim, where the noise of the measured pixels
// would bend a fit.
TEST(Infer, FilledPixelsOfARegionHaveItsPlanesNormal) {
  const InferenceResult result = InferPlanes(PlainScene().Input(MakeMeasured(0.5)), StereoOptions(), {});
  int filled = 0, close = 0;
  for (int y = 40; y < 80; ++y) {
    for (int x = 50; x < 110; ++x) {
      filled += result.filled(x, y) != 0;
      close += Dot(result.map(x, y).normal, Wall().normal) > std::cos(1 * M_PI / 180);
    }
  }
  EXPECT_EQ(filled, 60 * 40);
  EXPECT_GE(close, 0.8 * filled);  // the others chose a line
}

TEST(Infer, AMeasurementOfAnotherViewConfirms) {
  const PlainScene scene;
  InferenceInput input = scene.Input(MakeMeasured(0));
  for (const double factor : {1.0, 1.005}) {
    input.source_depths = {SourceDepths(factor)};
    EXPECT_EQ(NumFilled(InferPlanes(input, StereoOptions(), {}), kInferredConfirmed), 60 * 40) << factor;
  }
  // Too far to confirm and too near to contradict; nearer than the wall, it hides it.
  for (const double factor : {1.015, 0.9}) {
    input.source_depths = {SourceDepths(factor)};
    EXPECT_EQ(NumFilled(InferPlanes(input, StereoOptions(), {}), kInferredAlone), 60 * 40) << factor;
  }
}

// A window in the wall: the other view measured what lies behind, which has another brightness there.
TEST(Infer, WhatAnotherViewSeesThroughStaysAHole) {
  for (const InferenceMode mode : {InferenceMode::kMinCost, InferenceMode::kMrf}) {
    InferenceOptions options;
    options.mode = mode;
    const PlainScene scene;
    InferenceInput input = scene.Input(MakeMeasured(0));
    input.source_depths = {SourceDepths(1.1)};
    input.sources[0].image = std::make_shared<GrayImage>(kWidth, kHeight, std::uint8_t{150});
    EXPECT_EQ(NumFilled(InferPlanes(input, StereoOptions(), options)), 0);
    options.formulas = Formulas::kPaper;
    EXPECT_EQ(NumFilled(InferPlanes(input, StereoOptions(), options), kInferredConfirmed), 60 * 40);
  }
}

// The same brightness: what lies behind is what this view sees through the window.
TEST(Infer, AWindowShowsWhatAnotherViewMeasuredBehindIt) {
  const PlainScene scene;
  InferenceInput input = scene.Input(MakeMeasured(0));
  input.source_depths = {SourceDepths(1.1)};
  const InferenceResult result = InferPlanes(input, StereoOptions(), {});
  EXPECT_EQ(NumFilled(result), NumFilled(result, kInferredConfirmed));
  EXPECT_GT(NumFilled(result), 0.9 * 60 * 40);
  // n . X = 1.1 * (3 n_z - 0.5 n_x) from the source camera, half a metre to the right.
  const Vec3f n = Wall().normal;
  const double factor = (1.1 * (3 * n.z - 0.5 * n.x) + 0.5 * n.x) / (3 * n.z);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (result.filled(x, y) == 0) continue;
      ASSERT_NEAR(result.map(x, y).depth * Wall().InverseDepth(x, y), factor, 1e-5) << x << ", " << y;
    }
  }
}

TEST(Infer, OffFillsNothing) {
  InferenceOptions options;
  options.mode = InferenceMode::kOff;
  const PlaneMap measured = MakeMeasured(0);
  const InferenceResult result = InferPlanes(PlainScene().Input(measured), StereoOptions(), options);
  EXPECT_EQ(NumFilled(result), 0);
  for (std::size_t i = 0; i < measured.size(); ++i)
    ASSERT_TRUE(SameBits(result.map.data()[i], measured.data()[i]));
}

TEST(Infer, WithoutAnyMeasurementEverythingStaysAHole) {
  const InferenceResult result =
      InferPlanes(PlainScene().Input(PlaneMap(kWidth, kHeight)), StereoOptions(), {});
  EXPECT_EQ(NumFilled(result), 0);
  EXPECT_EQ(result.statistics.num_nodes, 0);
}

TEST(Infer, GivesTheSameBytesForAnyNumberOfThreads) {
  const PlainScene scene;
  const InferenceInput input = scene.Input(MakeMeasured(0.5));
  InferenceResult results[3];
  const int threads[3] = {1, 2, 7};
  for (int i = 0; i < 3; ++i) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads[i]);
    results[i] = InferPlanes(input, StereoOptions(), {});
  }
  for (int i = 1; i < 3; ++i) {
    for (std::size_t p = 0; p < results[0].map.size(); ++p) {
      ASSERT_TRUE(SameBits(results[i].map.data()[p], results[0].map.data()[p]));
    }
  }
}

}  // namespace
}  // namespace phi

#include "phi/inference/infer.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>
#include <tbb/global_control.h>

#include "phi/base/error.h"
#include "phi/inference/image_regions.h"
#include "phi/inference/infer_holes.h"
#include "tests/support/error_message.h"

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

  InferenceInput Input(const MeasurementMap& measured) const {
    InferenceInput input;
    input.reference = {&reference, plain};
    input.sources = {{&source, plain}};
    input.measured = std::make_shared<const MeasurementMap>(measured);
    return input;
  }
};

bool InHole(int x, int y) { return x >= 50 && x < 110 && y >= 40 && y < 80; }

// disparity_noise: standard deviation in pixels for a baseline of 0.5 m.
MeasurementMap MakeMeasured(double disparity_noise) {
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
  return AllMeasured(map);
}

// What the source view of PlainScene measured: the wall `factor` times as far as it is.
std::shared_ptr<const MeasuredDepths> SourceDepths(double factor) {
  DepthMap depths(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      depths(x, y) = static_cast<float>(factor / Wall().InverseDepth(x, y, 0.5));
    }
  }
  return std::make_shared<const MeasuredDepths>(AllMeasured(depths));
}

std::int64_t NumFilled(const InferenceResult& result) {
  return std::count_if(result.map.states.begin(), result.map.states.end(), IsInferred);
}

std::int64_t NumOf(PixelState state, const InferenceResult& result) {
  return std::count(result.map.states.begin(), result.map.states.end(), state);
}

bool SameBits(const PlaneHypothesis& a, const PlaneHypothesis& b) {
  return a.depth == b.depth && a.normal.x == b.normal.x && a.normal.y == b.normal.y &&
         a.normal.z == b.normal.z;
}

// All that is not measured is inferred on the wall; what is measured stays.
void ExpectTheWholeWall(const MeasurementMap& measured) {
  const Wall wall;
  for (const InferenceMode mode : {InferenceMode::kMinCost, InferenceMode::kMrf}) {
    InferenceOptions options;
    options.mode = mode;
    const InferenceResult result = InferPlanes(PlainScene().Input(measured), StereoOptions(), options);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const bool is_measured = measured.states(x, y) == PixelState::kMeasured;
        ASSERT_EQ(result.map.states(x, y), is_measured ? PixelState::kMeasured : PixelState::kInferredAlone)
            << x << ", " << y;
        ASSERT_NEAR(result.map.planes(x, y).depth * wall.InverseDepth(x, y), 1, 3e-6) << x << ", " << y;
        ASSERT_TRUE(!is_measured || SameBits(result.map.planes(x, y), measured.planes(x, y)));
        EXPECT_GT(Dot(result.map.planes(x, y).normal, wall.normal), 1 - 1e-5f);
      }
    }
  }
}

TEST(Infer, APlaneWithAHoleComesBack) {
  const MeasurementMap measured = MakeMeasured(0);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) ASSERT_EQ(measured.planes(x, y).depth > 0, !InHole(x, y));
  }
  ExpectTheWholeWall(measured);
}

// The left third is a clue: it comes back on the wall, as inferred depth.
TEST(Infer, CluesCarryTheWallAndAreInferred) {
  MeasurementMap measured = MakeMeasured(0);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 50; ++x) measured.states(x, y) = PixelState::kClue;
  }
  measured.planes(140, 20).depth *= 0.9f;
  measured.states(140, 20) = PixelState::kClue;
  ExpectTheWholeWall(measured);
}

// Itself, and 16 pixels in each of eight directions; where the image is even, as here, a line of one side says nothing.
TEST(Infer, AClueAloneCarriesShortLines) {
  PlaneMap planes(kWidth, kHeight);
  planes(80, 60) = {{0, 0, -1}, 3};
  MeasurementMap measured = AllMeasured(planes);
  measured.states(80, 60) = PixelState::kClue;
  const InferenceResult even =
      InferPlanes(PlainScene().Input(measured), StereoOptions(), InferenceOptions());
  EXPECT_EQ(even.map.planes(80, 60).depth, 3);
  EXPECT_EQ(NumFilled(even), 1);
  InferenceOptions options;
  options.method.rules.Set(Rule::kEvenLines, 0);
  const InferenceResult result = InferPlanes(PlainScene().Input(measured), StereoOptions(), options);
  EXPECT_EQ(result.map.planes(80, 60).depth, 3);
  EXPECT_EQ(result.map.planes(96, 44).depth, 3);
  EXPECT_EQ(result.map.planes(97, 60).depth, 0);
  EXPECT_EQ(NumFilled(result), 1 + 8 * 16);
}

// In the paper's form they are holes.
TEST(Infer, CluesAnchorNothingInThePapersForm) {
  MeasurementMap measured = MakeMeasured(0);
  std::replace(measured.states.begin(), measured.states.end(), PixelState::kMeasured, PixelState::kClue);
  InferenceOptions options;
  options.method.formulas = Formulas::kPaper;
  EXPECT_EQ(NumFilled(InferPlanes(PlainScene().Input(measured), StereoOptions(), options)), 0);
}

TEST(Infer, NormalsOfFilledPixelsWithstandNoise) {
  const InferenceResult result = InferPlanes(PlainScene().Input(MakeMeasured(0.1)), StereoOptions(), {});
  int filled = 0, close = 0;
  for (int y = 40; y < 80; ++y) {
    for (int x = 50; x < 110; ++x) {
      if (!IsInferred(result.map.states(x, y))) continue;
      ++filled;
      EXPECT_NEAR(Norm(result.map.planes(x, y).normal), 1, 1e-5f);
      close += Dot(result.map.planes(x, y).normal, Wall().normal) > std::cos(10 * M_PI / 180);
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
      filled += IsInferred(result.map.states(x, y));
      close += Dot(result.map.planes(x, y).normal, Wall().normal) > std::cos(1 * M_PI / 180);
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
    EXPECT_EQ(NumOf(PixelState::kInferredConfirmed, InferPlanes(input, StereoOptions(), {})), 60 * 40)
        << factor;
  }
  // Too far off to confirm.
  for (const double factor : {1.015, 0.9}) {
    input.source_depths = {SourceDepths(factor)};
    EXPECT_EQ(NumOf(PixelState::kInferredAlone, InferPlanes(input, StereoOptions(), {})), 60 * 40) << factor;
  }
}

// Two views may share an error: what few saw carries no plane, tells nothing of other views, and comes back as it was.
TEST(Infer, WhatIsMaskedGetsNoDepth) {
  const PlainScene scene;
  const auto backend = MakeCpuBackend(2);
  InferenceInput input = scene.Input(MakeMeasured(0));
  const InferenceResult whole = InferHoles(*backend, input, StereoOptions(), {});
  auto mask = std::make_shared<Array2D<std::uint8_t>>(kWidth, kHeight, 255);
  (*mask)(70, 55) = (*mask)(80, 70) = 0;
  input.mask = mask;
  const InferenceResult masked = InferHoles(*backend, input, StereoOptions(), {});
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool is_masked = (*mask)(x, y) == 0;
      ASSERT_EQ(masked.map.states(x, y), is_masked ? PixelState::kNone : whole.map.states(x, y)) << x << ", " << y;
      // The region's plane rests on other draws.
      ASSERT_NEAR(masked.map.planes(x, y).depth, is_masked ? 0 : whole.map.planes(x, y).depth, 1e-4f) << x << ", " << y;
    }
  }
}

// What is masked is as bright as what surrounds it, so that a mask in the shade is no lamp: on a device, too.
TEST(Infer, UnderAMaskNothingIsOverexposed) {
  PlainScene scene;
  for (const std::uint8_t brightness : {40, 200}) {
    scene.plain = std::make_shared<GrayImage>(kWidth, kHeight, brightness);
    InferenceInput input = scene.Input(MakeMeasured(0));
    auto mask = std::make_shared<Array2D<std::uint8_t>>(kWidth, kHeight, 255);
    for (int y = 50; y < 60; ++y) {
      for (int x = 70; x < 80; ++x) (*mask)(x, y) = 0;
    }
    input.mask = mask;
    const InferenceResult result = InferPlanes(input, StereoOptions(), {});
    EXPECT_TRUE(IsInferred(result.map.states(75, 55))) << int{brightness};
  }
}

TEST(Infer, DepthsOfASourceMustFitItsImage) {
  const PlainScene scene;
  InferenceInput input = scene.Input(MakeMeasured(0));
  input.source_depths = {std::make_shared<const MeasuredDepths>(AllMeasured(DepthMap(kWidth / 2, kHeight, 3.0f)))};
  EXPECT_THAT(test_support::MessageOf<InputError>([&] { InferPlanes(input, StereoOptions(), {}); }), testing::HasSubstr("source"));
}

TEST(Infer, RegionsMustFitTheImage) {
  const PlainScene scene;
  InferenceInput input = scene.Input(MakeMeasured(0));
  for (const auto& [width, height] : {std::pair{kWidth + 1, kHeight}, {kWidth, kHeight - 1}}) {
    input.regions = std::make_shared<const ImageRegions>(FindRegions(GrayImage(width, height, 128)));
    EXPECT_THROW(InferPlanes(input, StereoOptions(), {}), UsageError) << width << "x" << height;
  }
  input.regions = std::make_shared<const ImageRegions>(FindRegions(*scene.plain));
  EXPECT_NO_THROW(InferPlanes(input, StereoOptions(), {}));
}

// Another view's clues confirm nothing, and nothing refuses what it measured elsewhere: the second filter asks for agreement.
TEST(Infer, OnlyMeasurementsOfAnotherViewConfirm) {
  const PlainScene scene;
  InferenceInput input = scene.Input(MakeMeasured(0));
  for (const PixelState state : {PixelState::kMeasured, PixelState::kClue}) {
    for (const double factor : {1.0, 1.1}) {
      auto depths = std::make_shared<MeasuredDepths>(*SourceDepths(factor));
      std::fill(depths->states.begin(), depths->states.end(), state);
      input.source_depths = {depths};
      input.sources[0].image =
          std::make_shared<GrayImage>(kWidth, kHeight, std::uint8_t{150});  // nothing is pooled
      const InferenceResult result = InferPlanes(input, StereoOptions(), {});
      const bool is_evidence = state == PixelState::kMeasured;
      EXPECT_EQ(NumOf(PixelState::kInferredConfirmed, result), is_evidence && factor == 1 ? 60 * 40 : 0)
          << factor;
      EXPECT_EQ(NumOf(PixelState::kInferredAlone, result), is_evidence && factor == 1 ? 0 : 60 * 40) << factor;
    }
  }
}

TEST(Infer, OffFillsNothing) {
  InferenceOptions options;
  options.mode = InferenceMode::kOff;
  const MeasurementMap measured = MakeMeasured(0);
  const InferenceResult result = InferPlanes(PlainScene().Input(measured), StereoOptions(), options);
  EXPECT_EQ(NumFilled(result), 0);
  for (std::size_t i = 0; i < measured.size(); ++i)
    ASSERT_TRUE(SameBits(result.map.planes.data()[i], measured.planes.data()[i]));
}

TEST(Infer, WithoutAnyMeasurementEverythingStaysAHole) {
  const InferenceResult result =
      InferPlanes(PlainScene().Input(AllMeasured(PlaneMap(kWidth, kHeight))), StereoOptions(), {});
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
      ASSERT_TRUE(SameBits(results[i].map.planes.data()[p], results[0].map.planes.data()[p]));
    }
  }
}

TEST(Infer, WhatTheHostDoesBesideItHasItsThreads) {
  int num_threads = 0;
  MakeCpuBackend(1)->RunOnHost([&] { num_threads = tbb::this_task_arena::max_concurrency(); });
  EXPECT_EQ(num_threads, 1);
}

}  // namespace
}  // namespace phi

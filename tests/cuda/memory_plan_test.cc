// What calls need, by hand from the sizes; and that a call done in parts gives the bytes of the whole.
#include "cuda/memory_plan.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "cuda/calls_on_gpu.h"
#include "phi/base/error.h"
#include "phi/matching/coarse_start.h"
#include "tests/cuda/cuda_test_fixture.h"
#include "tests/support/exact_scenes.h"

namespace phi::gpu {
namespace {

using test_support::ExactSceneOptions;
using test_support::RenderedScene;

constexpr int kWidth = 96, kHeight = 160, kNumSources = 4;

RenderedScene TallScene() {
  ExactSceneOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.focal = 120;
  return test_support::SphereScene(options);
}

EstimationInput InputOf(const RenderedScene& scene) { return MakeInput(scene, 0, 2, 10); }

const Task& TestTask() {
  static const Task task{"estimation", "a.jpg", kWidth, kHeight};
  return task;
}

// The largest budget that cuts the state into the smallest bands.
std::int64_t SmallestBandsBudget(const EstimationInput& input, bool coarse_start = false) {
  std::int64_t budget = EstimationBytes(input, coarse_start) - 1;
  while (PlanEstimation(input, budget, TestTask(), coarse_start).band_rows > kTileSide) budget -= 64;
  return budget;
}

TEST(MemoryPlan, CountsStateAndImages) {
  const RenderedScene scene = TallScene();
  const EstimationInput input = InputOf(scene);
  ASSERT_EQ(input.sources.size(), std::size_t{kNumSources});
  // Plane 16, cost 4, window level 1, whether it changed 1.
  const std::int64_t state = 96 * 160 * (16 + 4 + 1 + 1);
  // Five bytes for each pixel of one colour, 128 in a tile of 16 x 16.
  const std::int64_t notes = 6 * 10 * 128 * 5;
  // A byte a pixel on four levels: 96x160, 48x80, 24x40, 12x20.
  const std::int64_t image = 15360 + 3840 + 960 + 240;
  const std::int64_t num_images = 1 + kNumSources + 1;  // one that is about to go
  EXPECT_EQ(EstimationBytes(input), state + notes + num_images * image);
}

// A witness's image and depths stay on the host.
TEST(MemoryPlan, AnInferenceCountsTheSourcesThatItIsMatchedWith) {
  const RenderedScene scene = TallScene();
  InferenceInput input;
  input.reference = InputOf(scene).reference;
  input.sources = InputOf(scene).sources;
  input.measured = std::make_shared<const MeasurementMap>(MeasurementMap{*scene.truth[0], {}});
  for (std::size_t j = 1; j < scene.views.size(); ++j) {
    input.source_depths.push_back(std::make_shared<const MeasuredDepths>(MeasuredDepths{DepthsOf(*scene.truth[j]), {}}));
  }
  const auto bytes = [&] { return PlanInference(input, std::int64_t{1} << 40, TestTask()); };
  const std::int64_t of_all = bytes();
  input.max_matched = 2;
  const std::int64_t image = 15360 + 3840 + 960 + 240, depths = 96 * 160 * 4;
  EXPECT_EQ(of_all - bytes(), 2 * (image + depths));
}

TEST(MemoryPlan, CountsTheCoarseStart) {
  const RenderedScene scene = TallScene();
  const EstimationInput input = InputOf(scene);
  EXPECT_EQ(EstimationBytes(input, true), EstimationBytes(input) + 48 * 80 * 16);
  const EstimationPlan bands =
      PlanEstimation(input, SmallestBandsBudget(input) + 48 * 8 * 16, TestTask(), true);
  EXPECT_EQ(bands.band_rows, kTileSide);
  EXPECT_EQ(bands.num_coarse_pixels, 48 * 8);
}

TEST(MemoryPlan, TakesTheWholeWhereItFits) {
  const RenderedScene scene = TallScene();
  const EstimationInput input = InputOf(scene);
  const std::int64_t whole = EstimationBytes(input);
  EXPECT_EQ(PlanEstimation(input, whole, TestTask()).band_rows, 0);
  for (std::int64_t budget = whole - 1; budget >= SmallestBandsBudget(input); budget -= 1000) {
    const EstimationPlan plan = PlanEstimation(input, budget, TestTask());
    EXPECT_GT(plan.band_rows, 0);
    EXPECT_EQ(plan.band_rows % kTileSide, 0);
    EXPECT_LE(plan.bytes, budget);
  }
}

TEST(MemoryPlan, RefusesWithTheBytesNeededAndAvailable) {
  const RenderedScene scene = TallScene();
  // Images as above, levels of the windows and whether pixels changed, notes of a row of tiles, and 16 rows with 23 on each side.
  const std::int64_t needed = 6 * 20400 + 2 * 96 * 160 + 6 * 128 * 5 + 96 * (16 + 2 * 23) * (16 + 4);
  EXPECT_NO_THROW(PlanEstimation(InputOf(scene), needed, TestTask()));
  try {
    PlanEstimation(InputOf(scene), needed - 1, TestTask());
    FAIL();
  } catch (const TooLargeForDevice& error) {
    const std::string message = error.what();
    for (const char* part : {"a.jpg", "0.3 MB", "PhiStereo.device_memory", "max_image_size"}) {
      EXPECT_NE(message.find(part), std::string::npos) << part << " is not in: " << message;
    }
  }
}

TEST(MemoryBudget, ACallWaitsUntilTheOthersLeaveRoom) {
  MemoryBudget budget(100);
  auto first = std::make_unique<MemoryBudget::Lease>(&budget, 60);
  { const MemoryBudget::Lease beside(&budget, 40); }
  std::atomic<bool> has_started = false;
  std::thread waiting([&] {
    const MemoryBudget::Lease second(&budget, 41);
    has_started = true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(has_started);
  first.reset();
  waiting.join();
  EXPECT_TRUE(has_started);
}

TEST(MemoryBudget, FollowsWhatThereIsButNotBeyondWhatWasAllowed) {
  MemoryBudget budget(100);
  EXPECT_FALSE(budget.IsLowered());
  budget.Set(50);
  EXPECT_EQ(budget.bytes(), 50);
  EXPECT_TRUE(budget.IsLowered());
  budget.Set(180);
  EXPECT_EQ(budget.bytes(), 100);
  EXPECT_FALSE(budget.IsLowered());
}

TEST(MemoryBudget, WhoIsAloneWaitsForTheOthersAndTheyForIt) {
  MemoryBudget budget(100);
  auto running = std::make_unique<MemoryBudget::Lease>(&budget, 10);
  std::promise<void> is_alone, may_end;
  std::thread alone([&] {
    const MemoryBudget::Alone only(&budget);
    const MemoryBudget::Lease own(&budget, 200);  // its own calls pass
    is_alone.set_value();
    may_end.get_future().wait();
  });
  std::future<void> began = is_alone.get_future();
  EXPECT_EQ(began.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout) << "a call is under way";
  running.reset();
  began.wait();
  std::future<void> other = std::async(std::launch::async, [&] { const MemoryBudget::Lease later(&budget, 1); });
  EXPECT_EQ(other.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout) << "it is alone";
  may_end.set_value();
  alone.join();
  other.wait();
}

class SplitTest : public CudaTest {
 protected:
  struct Run {
    EstimationResult result;
    double samples = 0;
  };

  static Run Estimate(const EstimationInput& input, std::int64_t budget, Quality quality) {
    DeviceResources device(QueryDevice(0), budget);
    StereoOptions options;
    options.num_iterations = 2;
    options.quality = quality;
    Run run{EstimateOnGpu(&device, input, options)};
    run.samples = device.times.Of(CallKind::kEstimation).samples();
    return run;
  }

  static void ExpectSameBytesInBands(const EstimationInput& input, Quality quality = Quality::kStandard) {
    StereoOptions options;
    options.quality = quality;
    const bool coarse_start = EstimationParts(input, options).size() > 1;
    const std::int64_t bytes = EstimationBytes(input, coarse_start);
    const Run whole = Estimate(input, bytes, quality);
    for (const std::int64_t budget : {bytes - 1, SmallestBandsBudget(input, coarse_start)}) {
      const Run parts = Estimate(input, budget, quality);
      const int band_rows = PlanEstimation(input, budget, TestTask(), coarse_start).band_rows;
      EXPECT_EQ(std::memcmp(whole.result.map.data(), parts.result.map.data(), whole.result.map.bytes()), 0)
          << "bands of " << band_rows << " rows";
      EXPECT_EQ(std::memcmp(whole.result.cost.data(), parts.result.cost.data(), whole.result.cost.bytes()), 0)
          << "bands of " << band_rows << " rows";
      EXPECT_EQ(whole.samples, parts.samples);
    }
  }
};

TEST_F(SplitTest, AnEstimationInPartsGivesTheBytesOfTheWhole) {
  const RenderedScene scene = TallScene();
  ExpectSameBytesInBands(InputOf(scene));
}

// Two coarser parts, odd sizes, and bands that do not end with the image.
TEST_F(SplitTest, ACoarseStartInPartsGivesTheBytesOfTheWhole) {
  ExactSceneOptions options;
  options.width = 387;
  options.height = 411;
  options.focal = 380;
  const RenderedScene scene = test_support::SphereScene(options);
  const EstimationInput input = InputOf(scene);
  StereoOptions fast;
  fast.quality = Quality::kFast;
  ASSERT_EQ(EstimationParts(input, fast).size(), 3u);
  ExpectSameBytesInBands(input, Quality::kFast);
}

TEST_F(SplitTest, ManyViewsInPartsGiveTheBytesOfTheWhole) {
  const RenderedScene scene = TallScene();
  EstimationInput input = InputOf(scene);
  const std::vector<ViewImage> sources = input.sources;
  for (int copy = 0; copy < 4; ++copy) {
    input.sources.insert(input.sources.end(), sources.begin(), sources.end());
  }
  ASSERT_EQ(input.sources.size(), 20u);
  ExpectSameBytesInBands(input);
}

// An estimate of one iteration, and sources that carry the truth.
TEST_F(SplitTest, ASharingInPartsGivesTheBytesOfTheWhole) {
  const RenderedScene scene = TallScene();
  StereoOptions options;
  options.num_iterations = 1;
  DeviceResources ample(QueryDevice(0), 0);
  SharingInput input;
  input.estimation = InputOf(scene);
  input.own = {&scene.views[0], std::make_shared<const MeasurementMap>(
                                    MeasurementMap{EstimateOnGpu(&ample, input.estimation, options).map, {}})};
  input.sources = scene.SourceTruth(0);
  const PlaneMap whole = ShareOnGpu(&ample, input, options)->planes;
  std::size_t num_taken = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) num_taken += whole.data()[i].depth != input.own.map->planes.data()[i].depth;
  EXPECT_GT(num_taken, whole.size() / 10);
  EXPECT_LT(num_taken, whole.size());
  // Images as of an estimation; the map and two of the others; scales of the windows; of a band planes 16, leads 1, nearest 8.
  const std::int64_t images = (kNumSources + 2) * (15360 + 3840 + 960 + 240), map = std::int64_t{kWidth} * kHeight * 16;
  const std::int64_t fixed = images + 3 * map + std::int64_t{kWidth} * kHeight, row = std::int64_t{kWidth} * (16 + 1 + 8);
  EXPECT_THROW(PlanSharing(input, fixed + 16 * row - 1, TestTask()), ResourceError);
  struct Parts {
    std::int64_t budget;
    int band_rows, num_at_once;
  };
  for (const Parts& parts : {Parts{fixed + 16 * row, 16, 1}, {fixed + 159 * row, 144, 1}, {fixed + 160 * row, 160, 1},
                             {fixed + 160 * row + 2 * map, 160, 3}, {fixed + 160 * row + 9 * map, 160, 4}}) {
    const SharingPlan plan = PlanSharing(input, parts.budget, TestTask());
    EXPECT_EQ(plan.band_rows, parts.band_rows);
    EXPECT_EQ(plan.num_sources_at_once, parts.num_at_once);
    EXPECT_LE(plan.bytes, parts.budget);
    DeviceResources scarce(QueryDevice(0), parts.budget);
    const PlaneMap in_parts = ShareOnGpu(&scarce, input, options)->planes;
    EXPECT_EQ(std::memcmp(whole.data(), in_parts.data(), whole.bytes()), 0) << parts.band_rows << ", " << parts.num_at_once;
  }
}

// The more so, the farther to the right.
PlaneMap PartlyWrong(PlaneMap map) {
  for (int y = 40; y < 60; ++y) {
    for (int x = 0; x < kWidth; ++x) map(x, y).depth *= 1 + 0.002f * static_cast<float>(x);
  }
  return map;
}

TEST_F(SplitTest, AFilterInPartsGivesTheBytesOfTheWhole) {
  const RenderedScene scene = TallScene();
  const PlaneMap map = PartlyWrong(*scene.truth[0]);
  FilterInput input;
  StateMap states(kWidth, kHeight, PixelState::kMeasured);
  for (int x = 0; x < kWidth; ++x) states(x, 50) = PixelState::kInferredConfirmed;
  input.reference = {&scene.views[0], std::make_shared<const MeasurementMap>(MeasurementMap{map, states})};
  input.sources = scene.SourceTruth(0);
  FilterOptions options;
  options.min_num_consistent = 3;
  options.min_num_consistent_inferred = 2;
  // The map and two of the others, the map's states, testimonies and verdicts.
  const std::int64_t smallest = std::int64_t{kWidth} * kHeight * (3 * 16 + 1 + 4 + 1);
  EXPECT_THROW(PlanFilter(input, smallest - 1, TestTask()), ResourceError);
  DeviceResources ample(QueryDevice(0), 0);
  const PlaneMap whole = FilterOnGpu(&ample, input, options).planes;
  std::size_t num_kept = 0;
  for (const PlaneHypothesis& h : whole) num_kept += h.depth > 0;
  EXPECT_GT(num_kept, whole.size() / 4);
  EXPECT_LT(num_kept, whole.size());
  for (int num_sources = 1; num_sources <= kNumSources; ++num_sources) {
    const std::int64_t budget = smallest + (num_sources - 1) * std::int64_t{kWidth} * kHeight * 16;
    EXPECT_EQ(PlanFilter(input, budget, TestTask()).num_sources_at_once, num_sources);
    DeviceResources scarce(QueryDevice(0), budget);
    const PlaneMap parts = FilterOnGpu(&scarce, input, options).planes;
    EXPECT_EQ(std::memcmp(whole.data(), parts.data(), whole.bytes()), 0) << num_sources << " at once";
  }
}

// An estimate that is judged: by what the sources of all turns said.
TEST_F(SplitTest, AJudgementInPartsGivesTheBytesOfTheWhole) {
  const RenderedScene scene = TallScene();
  const PlaneMap map = PartlyWrong(*scene.truth[0]);
  FilterInput input;
  input.reference = {&scene.views[0], std::make_shared<const MeasurementMap>(MeasurementMap{map, {}})};
  input.sources = scene.SourceTruth(0);
  input.judgement = {.image = scene.Image(0).image,
                     .noise = 2,
                     .precision = DepthPrecision(scene.views[0].camera, {&scene.views[1].camera, &scene.views[2].camera})};
  // The map and two of the others, testimonies, box sums, plain pixels and states, and the image.
  const std::int64_t smallest = std::int64_t{kWidth} * kHeight * (3 * 16 + 4 + 2 + 1 + 1) +
                                static_cast<std::int64_t>(GrayPyramid::Bytes(kWidth, kHeight));
  EXPECT_THROW(PlanFilter(input, smallest - 1, TestTask()), ResourceError);
  DeviceResources ample(QueryDevice(0), 0);
  const MeasurementMap whole = FilterOnGpu(&ample, input, {});
  EXPECT_GT(std::count(whole.states.begin(), whole.states.end(), PixelState::kMeasured), whole.size() / 10);
  for (int num_sources = 1; num_sources <= kNumSources; ++num_sources) {
    const std::int64_t budget = smallest + (num_sources - 1) * std::int64_t{kWidth} * kHeight * 16;
    EXPECT_EQ(PlanFilter(input, budget, TestTask()).num_sources_at_once, num_sources);
    DeviceResources scarce(QueryDevice(0), budget);
    const MeasurementMap parts = FilterOnGpu(&scarce, input, {});
    EXPECT_EQ(std::memcmp(whole.planes.data(), parts.planes.data(), whole.planes.bytes()), 0) << num_sources << " at once";
    EXPECT_EQ(std::memcmp(whole.states.data(), parts.states.data(), whole.states.bytes()), 0) << num_sources << " at once";
  }
}

// A source that is the reference itself: whatever the hypothesis, a window lies inside where it does in the reference.
TEST_F(SplitTest, CountsTheSamplesOfTheWindowsThatWereRead) {
  const RenderedScene scene = TallScene();
  EstimationInput input = InputOf(scene);
  input.sources = {scene.Image(0)};
  StereoOptions options;
  options.num_iterations = 0;  // the first hypotheses alone
  options.window_radius = 6.5;  // reaches 6.5 pixels: seven pixels from each border do not count
  options.window_step = 1.3;
  options.num_window_levels = 1;
  DeviceResources device(QueryDevice(0), 0);
  EstimateOnGpu(&device, input, options);
  EXPECT_EQ(device.times.Of(CallKind::kEstimation).samples(), (kWidth - 14) * (kHeight - 14) * 121.0);
}

}  // namespace
}  // namespace phi::gpu

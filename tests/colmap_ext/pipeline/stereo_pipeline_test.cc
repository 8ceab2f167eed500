#include "colmap_ext/pipeline/stereo_pipeline.h"
#include "colmap_ext/byte_count.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>

#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/pipeline/run_status.h"
#include "colmap_ext/pipeline/stale_maps.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "phi/base/cancellation.h"
#include "phi/base/device_error.h"
#include "phi/base/error.h"
#include "phi/base/whole_array.h"
#include "tests/support/error_message.h"
#include "tests/support/fake_backend.h"
#include "tests/support/log_capture.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/run_pipeline.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::FakeCalls;
using test_support::HashMaps;
using test_support::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr int kNumImages = 5;

class StereoPipelineTest : public ::testing::Test {
 protected:
  void SetUp() override {
    names_ = test_support::WriteNoiseWorkspace(folder_.path(), {.num_images = kNumImages});
  }

  RunSummary Run(const std::filesystem::path& path) {
    return test_support::RunPipeline({.path = path, .mask_path = masks_}, options_,
                                     test_support::MakeFakeBackends(&calls_, num_backends_, num_concurrent_));
  }
  RunSummary Run() { return Run(folder_.path()); }

  // The maps that an undisturbed run makes with the present options.
  std::vector<std::string> CleanMaps() {
    const TemporaryFolder clean;
    test_support::WriteNoiseWorkspace(clean.path(), {.num_images = kNumImages});
    FakeCalls* const calls = &calls_;
    const auto on_call = std::exchange(calls->on_call, nullptr);
    Run(clean.path());
    calls->on_call = on_call;
    calls->estimates = calls->filters = calls->inferences = 0;
    return HashMaps(clean.path());
  }

  void BreakInEachStage();
  void RunWithOtherWorkersAndMemory();

  std::filesystem::path DepthPath(int image, const std::string& kind) const {
    return folder_ / "stereo/depth_maps" / (names_[image] + "." + kind + ".bin");
  }

  TemporaryFolder folder_;
  std::filesystem::path masks_;  // empty: none
  std::vector<std::string> names_;
  PipelineOptions options_;
  FakeCalls calls_;
  int num_backends_ = 1, num_concurrent_ = 1;
};

TEST_F(StereoPipelineTest, MakesEveryMapOfTheWorkspace) {
  const RunSummary summary = Run();
  EXPECT_TRUE(summary.failures.empty());
  EXPECT_EQ(summary.num_images, kNumImages);
  // Per image: depth and normals of three kinds, and masks of two. Nothing else stays.
  EXPECT_THAT(HashMaps(folder_.path()), SizeIs(kNumImages * 8));
  EXPECT_EQ(calls_.estimates, kNumImages);
  EXPECT_EQ(calls_.inferences, kNumImages);
  EXPECT_EQ(calls_.filters, 2 * kNumImages);
}

TEST_F(StereoPipelineTest, MapsToBeMadeAgainAreNamedWithWhoIsToMakeThem) {
  Run();
  ++options_.stereo.seed;
  const auto described = [&] { return DescribeStaleMaps(Workspace({.path = folder_.path()}), kGeometric); };
  std::vector<std::string> while_at_work;
  calls_.on_call = [&](const std::string&, const std::string&) {
    const WorkspaceLock lock(folder_ / "stereo");
    while_at_work = described();
    throw phi::Cancelled();
  };
  EXPECT_THROW(Run(), phi::Cancelled);
  const std::string which = "5 of 5 geometric maps, " + names_[0] + " the first, ";
  EXPECT_THAT(while_at_work, ElementsAre(which + "are to be made again by a run that is at work; fuse again when it is done"));
  EXPECT_THAT(described(), ElementsAre(which + "were to be made again by a run that stopped; run patch_match_stereo again"));
}

// Each image reads its neighbour alone.
TEST_F(StereoPipelineTest, AnImageGoesOnWhenWhatItReadsIsThere) {
  test_support::ReadNeighboursAlone(folder_.path(), names_);
  const test_support::CallOrder order(&calls_);
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(order.size(), 5u * kNumImages);
  for (int i = 0; i < kNumImages; ++i) {
    EXPECT_GT(order.Place("filter", names_[i]), order.Place("estimate", names_[i == 0 ? 1 : i - 1]));
    EXPECT_GT(order.Place("infer", names_[i]), order.Place("filter", names_[i == 0 ? 1 : i - 1]));
  }
  EXPECT_LT(order.Place("infer", names_[0]), order.Place("estimate", names_[kNumImages - 1]));
}

// The first image reads the second, which makes a map, and the third, which makes none.
TEST_F(StereoPipelineTest, InferenceHearsTheRegionsOfSourcesThatHaveAMap) {
  test_support::WriteBytes(folder_ / "stereo/patch-match.cfg",
                           names_[0] + "\n" + names_[1] + ", " + names_[2] + "\n" + names_[1] + "\n" + names_[0] + "\n");
  std::mutex mutex;
  std::map<std::string, std::vector<bool>> told;
  calls_.on_infer = [&](const phi::InferenceInput& input) {
    std::lock_guard<std::mutex> lock(mutex);
    std::vector<bool>& there = told[input.reference.view->name];
    for (const auto& regions : input.source_regions) there.push_back(regions != nullptr);
  };
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(told[names_[0]], (std::vector<bool>{true, false}));
  EXPECT_EQ(told[names_[1]], std::vector<bool>{true});
  told.clear();
  options_.inference.method.rules.Set(phi::Rule::kSourceRegions, 0);
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(told[names_[0]], std::vector<bool>());
}

// As above; the second image's regions choose too, by the first one's.
TEST_F(StereoPipelineTest, InferenceHearsWhatTheRegionsOfItsSourcesChose) {
  test_support::WriteBytes(folder_ / "stereo/patch-match.cfg",
                           names_[0] + "\n" + names_[1] + ", " + names_[2] + "\n" + names_[1] + "\n" + names_[0] + "\n");
  std::mutex mutex;
  std::map<std::string, std::vector<std::shared_ptr<const phi::ViewChoice>>> own, told;
  calls_.on_infer = [&](const phi::InferenceInput& input) {
    std::lock_guard<std::mutex> lock(mutex);
    own[input.reference.view->name] = {input.choice};
    told[input.reference.view->name] = input.source_choices;
  };
  EXPECT_TRUE(Run().failures.empty());
  ASSERT_EQ(told[names_[0]].size(), 2u);
  EXPECT_NE(told[names_[0]][0], nullptr);
  EXPECT_EQ(told[names_[0]][1], nullptr);
  EXPECT_EQ(told[names_[0]][0], own[names_[1]][0]) << "found once for both";
  EXPECT_EQ(told[names_[1]], own[names_[0]]);
  options_.inference.method.rules.Set(phi::Rule::kSecondChoice, 0);
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(own[names_[0]][0], nullptr);
  EXPECT_TRUE(told[names_[0]].empty());
}

// Before its own map is filtered.
TEST_F(StereoPipelineTest, SharesHypothesesBeforeTheFilter) {
  std::map<std::string, std::vector<std::string>> calls;
  std::mutex mutex;
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    std::lock_guard<std::mutex> lock(mutex);
    calls[image].push_back(stage);
  };
  EXPECT_TRUE(Run().failures.empty());
  for (const std::string& name : names_)
    EXPECT_EQ(calls[name], (std::vector<std::string>{"estimate", "share", "filter", "infer", "filter"}));
  calls.clear();
  options_.filter.method.rules.Set(phi::Rule::kSharedHypotheses, 0);
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(calls[names_[0]], (std::vector<std::string>{"filter", "infer", "filter"})) << "estimates serve both";
}

TEST_F(StereoPipelineTest, LeavesTheRunsFiguresInTheRecord) {
  Run();
  Run();  // finds everything done: no run worth a line
  const auto record = nlohmann::json::parse(test_support::ReadBytes(folder_ / "stereo/phimvs.json"));
  ASSERT_EQ(record["runs"].size(), 1u);
  const auto& run = record["runs"][0];
  ASSERT_EQ(run["stages"].size(), 5u) << run.dump(1);
  double seconds = 0;
  for (const auto& stage : run["stages"]) {
    EXPECT_EQ(stage["images"], kNumImages);
    seconds += stage["seconds"].get<double>();
  }
  // The fake's estimate leaves out every fifth of 24 x 16 pixels.
  EXPECT_EQ(run["stages"][0]["pixels"], kNumImages * 384);
  EXPECT_EQ(run["stages"][0]["pixels_with_depth"], kNumImages * 307);
  EXPECT_GT(seconds, 0);
  EXPECT_LE(seconds, run["seconds"].get<double>());
  EXPECT_NEAR(run["images_per_second"].get<double>() * run["seconds"].get<double>(), kNumImages, 1e-9);
  EXPECT_EQ(run["devices"][0]["name"], "fake");
  EXPECT_EQ(run["devices"][0]["peak_memory_bytes"], 3000000);
  EXPECT_EQ(run["devices"][0]["stages"][0]["samples_per_second"], 2e9);
  std::int64_t num_bytes = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ / "stereo")) {
    if (file.path().extension() == ".bin") num_bytes += static_cast<std::int64_t>(file.file_size());
  }
  EXPECT_NEAR(run["bytes_written"].get<double>(), num_bytes, 0.1 * num_bytes) << "masks come on top";
  EXPECT_GT(run["bytes_per_second_and_writer"].get<double>(), 0);
  EXPECT_GT(run["peak_memory_bytes"].get<std::int64_t>(), 1000000);
}

// The left half is masked. A mask is an edge in the reference alone, where it takes a sample's weight; the paper's have none. The
// filter knows what each source leaves out.
TEST_F(StereoPipelineTest, MasksAreEdgesWhereSamplesHaveWeights) {
  constexpr int kWidth = 24, kHeight = 16, kInside = kWidth / 2 - 1, kOutside = kWidth / 2;
  phi::Mask mask(kWidth, kHeight, 255);
  for (int y = 0; y < kHeight; ++y) std::fill(&mask(0, y), &mask(0, y) + kOutside, std::uint8_t{0});
  masks_ = folder_ / "masks";
  for (const std::string& name : names_) WriteGrayImage(masks_ / (name + ".png"), mask);
  for (const phi::Formulas formulas : {phi::Formulas::kRobust, phi::Formulas::kPaper}) {
    options_.stereo.method.formulas = formulas;
    calls_.estimates = calls_.filters = 0;
    calls_.on_estimate = [&](const phi::EstimationInput& input) {
      for (int y = 0; y < kHeight; ++y) {
        const phi::GrayImage& reference = *input.reference.image;
        const int step = std::abs(reference(kOutside, y) - reference(kInside, y));
        EXPECT_TRUE(formulas == phi::Formulas::kPaper ? step == 0 : step >= 128) << step;
        for (const phi::ViewImage& source : input.sources) {
          EXPECT_EQ((*source.image)(kOutside, y), (*source.image)(kInside, y));
        }
      }
    };
    calls_.on_filter = [&](const phi::FilterInput& input) {
      for (const phi::SourceMap& source : input.sources) {
        const auto left_out = source.load_mask();
        EXPECT_EQ((*left_out)(kInside, 3), 0);
        EXPECT_EQ((*left_out)(kOutside, 3), 255);
      }
    };
    EXPECT_TRUE(Run().failures.empty());
    EXPECT_EQ(calls_.estimates, kNumImages);
    EXPECT_GT(calls_.filters, 0);
  }
}

// Cameras in a row, all named as sources of all: matching takes 32 of them, those that see most of the same points from
// near by, and the filters take all.
TEST_F(StereoPipelineTest, MatchesInTheBestOfALongListOfSources) {
  TemporaryFolder other;
  test_support::WriteNoiseWorkspace(other.path(), {.num_images = 40});
  std::mutex mutex;
  std::map<std::string, std::vector<std::string>> matched;
  calls_.on_estimate = [&](const phi::EstimationInput& input) {
    const std::lock_guard<std::mutex> lock(mutex);
    for (const phi::ViewImage& source : input.sources) {
      matched[input.reference.view->name].push_back(source.view->name);
    }
  };
  std::vector<std::vector<std::string>> filtered;
  calls_.on_filter = [&](const phi::FilterInput& input) {
    filtered.emplace_back();
    for (const phi::SourceMap& source : input.sources) filtered.back().push_back(source.view->name);
  };
  EXPECT_TRUE(Run(other.path()).failures.empty());
  ASSERT_EQ(matched.size(), 40u);
  for (const auto& [reference, sources] : matched) EXPECT_THAT(sources, SizeIs(32)) << reference;
  EXPECT_THAT(matched["a/5.png"], ::testing::IsSupersetOf({"a/4.png", "a/6.png"}));
  // The filters begin with the map that the one before read last, but for the last image: that map is its own.
  ASSERT_THAT(filtered, SizeIs(80));
  for (std::size_t i = 0; i < 40; ++i) EXPECT_THAT(filtered[i], SizeIs(39));
  for (std::size_t i = 1; i < 39; ++i) EXPECT_EQ(filtered[i].front(), filtered[i - 1].back()) << i;
}

// The best three of five selected sources are matched, and the other two are witnesses. With other witnesses the estimates stay.
TEST_F(StereoPipelineTest, WitnessesAreFilteredAndInferredWithAndNotMatched) {
  TemporaryFolder other;
  const std::vector<std::string> names = test_support::WriteNoiseWorkspace(other.path(), {.num_images = 12});
  std::string config;
  for (const std::string& name : names) config += name + "\n__auto__, 20\n";
  test_support::WriteBytes(other / "stereo/patch-match.cfg", config);
  std::mutex mutex;
  std::map<std::string, std::vector<std::string>> matched, all;
  calls_.on_estimate = [&](const phi::EstimationInput& input) {
    const std::lock_guard<std::mutex> lock(mutex);
    for (const phi::ViewImage& source : input.sources) matched[input.reference.view->name].push_back(source.view->name);
  };
  calls_.on_filter = [&](const phi::FilterInput& input) { EXPECT_THAT(input.sources, SizeIs(5)); };
  calls_.on_infer = [&](const phi::InferenceInput& input) {
    const std::lock_guard<std::mutex> lock(mutex);
    for (const phi::ViewImage& source : input.sources) all[input.reference.view->name].push_back(source.view->name);
    EXPECT_EQ(input.NumMatched(), 3u);
    EXPECT_THAT(input.source_depths, SizeIs(5));
  };
  options_.view_selection.num_source_views = 3;
  options_.view_selection.num_witness_views = 5;
  EXPECT_TRUE(Run(other.path()).failures.empty());
  ASSERT_THAT(matched, SizeIs(12));
  for (const std::string& name : names) {
    EXPECT_THAT(matched[name], SizeIs(3));
    ASSERT_THAT(all[name], SizeIs(5));
    EXPECT_TRUE(std::equal(matched[name].begin(), matched[name].end(), all[name].begin())) << name;
  }
  const int num_estimates = calls_.estimates, num_inferences = calls_.inferences;
  options_.view_selection.num_witness_views = 1;  // those that are matched are witnesses in any case
  calls_.on_filter = [](const phi::FilterInput& input) { EXPECT_THAT(input.sources, SizeIs(3)); };
  calls_.on_infer = nullptr;
  EXPECT_TRUE(Run(other.path()).failures.empty());
  EXPECT_EQ(calls_.estimates, num_estimates);
  EXPECT_EQ(calls_.inferences, 2 * num_inferences);
}

TEST_F(StereoPipelineTest, FiltersReadUnfilteredMapsOfTheStageBefore) {
  options_.filter.method.formulas = phi::Formulas::kPaper;  // no other rule takes pixels away
  Run();
  // What the fake filter does, by hand at one pixel that it keeps: reference + 0.1 * sum of all sources' raw depths.
  constexpr int kX = 1, kY = 0;
  std::vector<float> raw;
  for (int i = 0; i < kNumImages; ++i) raw.push_back(ReadDepthMap(DepthPath(i, "photometric"))(kX, kY));
  const float measured = ReadDepthMap(DepthPath(2, "measured"))(kX, kY);
  EXPECT_NEAR(measured, raw[2] + 0.1f * (raw[0] + raw[1] + raw[3] + raw[4]), 1e-3f * measured);
}

TEST_F(StereoPipelineTest, FilledMaskHoldsOnlyPixelsThatTheSecondFilterKept) {
  options_.filter.method.formulas = phi::Formulas::kPaper;  // as above
  Run();
  const auto depth = ReadDepthMap(DepthPath(0, "geometric"));
  const auto filled = ReadMask(folder_ / "stereo/filled_masks" / (names_[0] + ".png"));
  // The fake estimator leaves every fifth pixel empty, its filter removes every seventh.
  EXPECT_EQ(filled(5, 0), 255);
  EXPECT_GT(depth(5, 0), 0);
  EXPECT_EQ(filled(1, 0), 0);
  EXPECT_GT(depth(1, 0), 0);
  EXPECT_EQ(filled(7, 0), 0);
  EXPECT_EQ(depth(7, 0), 0);
}

TEST_F(StereoPipelineTest, BytesDependNeitherOnWorkersNorOnMemory) {
  for (const bool is_compact : {false, true}) {
    options_.compact_maps = is_compact;
    RunWithOtherWorkersAndMemory();
  }
}

void StereoPipelineTest::RunWithOtherWorkersAndMemory() {
  const auto expected = CleanMaps();
  calls_.duration = std::chrono::milliseconds(2);
  for (const auto& [num_backends, num_concurrent, cache_bytes] : {std::tuple{1, 3, std::int64_t{1} << 30},
                                                                  {3, 2, std::int64_t{1} << 30},
                                                                  {1, 1, std::int64_t{1}},
                                                                  {2, 2, std::int64_t{1}},
                                                                  {2, 2, std::int64_t{20000}}}) {
    TemporaryFolder other;
    test_support::WriteNoiseWorkspace(other.path(), {.num_images = kNumImages});
    num_backends_ = num_backends;
    num_concurrent_ = num_concurrent;
    options_.cache_gigabytes = static_cast<double>(cache_bytes) / kBytesPerGigabyte;
    Run(other.path());
    EXPECT_EQ(HashMaps(other.path()), expected)
        << num_backends << " x " << num_concurrent << ", " << cache_bytes;
  }
}

TEST_F(StereoPipelineTest, RunsAsManyImagesAtOnceAsTheBackendsAskFor) {
  calls_.duration = std::chrono::milliseconds(20);
  num_backends_ = 2;
  num_concurrent_ = 2;
  Run();
  EXPECT_GT(calls_.most_at_once, 1);
  EXPECT_LE(calls_.most_at_once, 4);
}

TEST_F(StereoPipelineTest, CacheKeepsItsBudget) {
  const std::int64_t map_bytes = 24 * 16 * 16;
  options_.cache_gigabytes = 3 * map_bytes / kBytesPerGigabyte;
  const RunSummary summary = Run();
  // Above the budget only what waits to be written: two writers, as many jobs queued, and the one just made.
  EXPECT_LE(summary.peak_cache_bytes, (3 + 5) * map_bytes);
  // Without a bound: of the four stages' maps those of the stage at work and of the one before it, the latter's depths, the
  // states of these three, images, and the images' regions with their creases, what these tell and choose (next to nothing). And the
  // last filter's first result: what was measured stays until its image's is there.
  options_.cache_gigabytes = 1;
  options_.stereo.seed = 1;
  const std::int64_t all = kNumImages * (2 * map_bytes + 2 * (map_bytes / 4) + 5 * map_bytes / 16), one = map_bytes + map_bytes / 16;
  phi::ViewRegions told;
  const phi::SpotGrid grid(24, 16);
  told.label = phi::Array2D<std::int32_t>(grid.columns, grid.rows);
  phi::ViewChoice choice;
  choice.exposures.resize(4);
  EXPECT_EQ(Run().peak_cache_bytes, all + one + kNumImages * static_cast<std::int64_t>(told.bytes() + choice.bytes()));
}

TEST_F(StereoPipelineTest, SecondRunMakesNothing) {
  Run();
  calls_.estimates = calls_.filters = calls_.inferences = 0;
  const RunSummary summary = Run();
  EXPECT_EQ(calls_.estimates + calls_.filters + calls_.inferences, 0);
  EXPECT_EQ(summary.num_images_kept, kNumImages);
  EXPECT_THAT(SummaryLine(summary), HasSubstr("nothing to do"));
}

TEST_F(StereoPipelineTest, OtherOptionsMakeOnlyWhatDependsOnThem) {
  Run();
  calls_.estimates = calls_.filters = calls_.inferences = 0;
  options_.filter.max_normal_error = 20;
  Run();
  EXPECT_EQ(calls_.estimates, 0);
  EXPECT_EQ(calls_.filters, 2 * kNumImages);
  options_.stereo.seed = 5;
  Run();
  EXPECT_EQ(calls_.estimates, kNumImages);
}

TEST_F(StereoPipelineTest, CompactMapsHoldTheSameValues) {
  const auto expected = CleanMaps();
  options_.compact_maps = true;
  Run();
  const auto compact = HashMaps(folder_.path());
  // Per image: two compact maps, and depth, normals and mask of the geometric one.
  EXPECT_THAT(compact, SizeIs(kNumImages * 5));
  EXPECT_TRUE(std::filesystem::exists(DepthPath(1, "geometric")));
  EXPECT_FALSE(std::filesystem::exists(DepthPath(1, "measured")));
  calls_.estimates = calls_.filters = calls_.inferences = 0;
  EXPECT_THAT(SummaryLine(Run()), HasSubstr("nothing to do"));
  for (const bool is_compact : {false, false, true}) {
    options_.compact_maps = is_compact;
    Run();
    EXPECT_EQ(HashMaps(folder_.path()), is_compact ? compact : expected);
  }
  EXPECT_EQ(calls_.estimates + calls_.filters + calls_.inferences, 0) << "another form is no other map";
}

TEST_F(StereoPipelineTest, MakesADamagedCompactMapAgain) {
  options_.compact_maps = true;
  Run();
  const auto expected = HashMaps(folder_.path());
  std::filesystem::resize_file(folder_ / "stereo/compact_maps" / (names_[1] + ".photometric.map"), 300);
  calls_.estimates = 0;
  Run();
  EXPECT_EQ(calls_.estimates, 1);
  EXPECT_EQ(HashMaps(folder_.path()), expected);
}

TEST_F(StereoPipelineTest, CompactMapsTakeNoPlaceOfAnotherProgramsUnasked) {
  const auto path = DepthPath(2, "photometric");
  for (const bool is_compact : {true, false}) {  // of an empty workspace, and of one with compact maps
    WriteDepthMap(path, phi::Array2D<float>(24, 16, 5.0f));
    const std::string foreign = test_support::ReadBytes(path);
    options_.compact_maps = is_compact;
    options_.overwrite = false;
    EXPECT_THAT(test_support::InputErrorOf([&] { Run(); }), HasSubstr(path.string() + " was not made by phimvs"));
    EXPECT_EQ(test_support::ReadBytes(path), foreign);
    options_.overwrite = true;
    Run();
    EXPECT_EQ(HashMaps(folder_.path()), CleanMaps());
  }
}

TEST_F(StereoPipelineTest, GoesOnAfterABreakInEachStageWithTheBytesOfACleanRun) {
  for (const bool is_compact : {false, true}) {
    options_.compact_maps = is_compact;
    BreakInEachStage();
  }
}

void StereoPipelineTest::BreakInEachStage() {
  const auto expected = CleanMaps();
  for (const std::string stage : {"estimate", "filter", "infer"}) {
    TemporaryFolder other;
    test_support::WriteNoiseWorkspace(other.path(), {.num_images = kNumImages});
    std::atomic<int> count{0};
    calls_.on_call = [&](const std::string& s, const std::string&) {
      if (s == stage && ++count == 3) throw std::runtime_error("power cut");
    };
    EXPECT_THROW(Run(other.path()), std::runtime_error);
    calls_.on_call = nullptr;
    calls_.estimates = 0;
    Run(other.path());
    EXPECT_EQ(HashMaps(other.path()), expected) << stage;
    EXPECT_EQ(calls_.estimates, stage == "estimate" ? kNumImages - 2 : 0) << stage;
  }
}

TEST_F(StereoPipelineTest, MakesADamagedMapAgain) {
  Run();
  const auto expected = HashMaps(folder_.path());
  std::filesystem::resize_file(DepthPath(1, "photometric"), 100);
  EXPECT_THAT(SummaryLine(Run()), testing::Not(HasSubstr("nothing to do")));
  EXPECT_EQ(HashMaps(folder_.path()), expected);
  std::filesystem::resize_file(DepthPath(1, "photometric"), 100);
  std::filesystem::remove(DepthPath(2, "geometric"));
  calls_.estimates = 0;
  Run();
  EXPECT_EQ(calls_.estimates, 1);
  EXPECT_EQ(HashMaps(folder_.path()), expected);
}

TEST_F(StereoPipelineTest, RefusesMapsOfAnotherProgramUnlessToldToReplaceThem) {
  test_support::WriteBytes(DepthPath(3, "geometric"), "foreign");
  try {
    Run();
    FAIL() << "foreign map accepted";
  } catch (const phi::InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("3.png.geometric.bin"));
    EXPECT_THAT(error.what(), HasSubstr("--overwrite true"));
  }
  EXPECT_EQ(test_support::ReadBytes(DepthPath(3, "geometric")), "foreign");
  EXPECT_EQ(calls_.estimates, 0);
  options_.overwrite = true;
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(HashMaps(folder_.path()), CleanMaps());
}

// As COLMAP does in a workspace whose maps were moved away: maps of the right size under the same names.
TEST_F(StereoPipelineTest, MapsThatAnotherProgramMadeSinceAreNeverTouchedUnasked) {
  Run();
  for (const std::string kind : {"photometric", "geometric"}) {
    const auto path = DepthPath(2, kind);
    WriteDepthMap(path, phi::Array2D<float>(24, 16, 5.0f));
    const std::string foreign = test_support::ReadBytes(path);
    for (const double max_normal_error : {60.0, 20.0}) {  // the same options and others
      options_.filter.max_normal_error = max_normal_error;
      EXPECT_THAT(test_support::InputErrorOf([&] { Run(); }),
                  ::testing::AllOf(HasSubstr(path.string()), HasSubstr("--overwrite true")))
          << max_normal_error;
      EXPECT_EQ(test_support::ReadBytes(path), foreign) << kind;
    }
    options_.overwrite = true;
    EXPECT_TRUE(Run().failures.empty());
    EXPECT_EQ(HashMaps(folder_.path()), CleanMaps()) << kind;
    options_.overwrite = false;
  }
}

TEST_F(StereoPipelineTest, ACopiedWorkspaceKeepsItsMaps) {
  Run();
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / "stereo")) {
    if (entry.is_regular_file())
      std::filesystem::last_write_time(entry.path(), std::filesystem::file_time_type::clock::now());
  }
  calls_.estimates = calls_.filters = 0;
  EXPECT_EQ(Run().num_images_kept, kNumImages);
  EXPECT_EQ(calls_.estimates + calls_.filters, 0);
}

// Sizes are on the disk before data after some power cuts.
TEST_F(StereoPipelineTest, MakesMapsOfNothingAndDamagedMasksAgain) {
  Run();
  const auto expected = HashMaps(folder_.path());
  const auto mask = [this](int image) { return folder_ / "stereo/filled_masks" / (names_[image] + ".png"); };
  WriteDepthMap(DepthPath(0, "geometric"), phi::Array2D<float>(24, 16, 0.0f));
  test_support::WriteBytes(DepthPath(1, "photometric"),
                           std::string(std::filesystem::file_size(DepthPath(1, "photometric")), '\0'));
  test_support::WriteBytes(mask(2), "");
  test_support::WriteBytes(mask(3), std::string(std::filesystem::file_size(mask(3)), '\0'));
  calls_.estimates = 0;
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(calls_.estimates, 1);
  EXPECT_EQ(HashMaps(folder_.path()), expected);
}

// A run with other options that breaks off leaves maps of both runs, which are ours all the same.
TEST_F(StereoPipelineTest, GoesOnAfterABreakOverEarlierMaps) {
  Run();
  options_.stereo.seed = 3;
  const auto expected = CleanMaps();
  for (const std::string stage : {"estimate", "filter", "infer"}) {
    std::atomic<int> count{0};
    calls_.on_call = [&](const std::string& s, const std::string&) {
      if (s == stage && ++count == 3) throw std::runtime_error("power cut");
    };
    EXPECT_THROW(Run(), std::runtime_error) << stage;
  }
  calls_.on_call = nullptr;
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(HashMaps(folder_.path()), expected);
}

TEST_F(StereoPipelineTest, MissingImageFailsAloneAndIsDoneOnceItIsThere) {
  const auto image = folder_ / "images" / names_[1];
  const std::string bytes = test_support::ReadBytes(image);
  std::filesystem::remove(image);
  const RunSummary summary = Run();
  ASSERT_THAT(summary.failures, SizeIs(1));
  EXPECT_EQ(summary.failures[0].image, names_[1]);
  EXPECT_EQ(summary.failures[0].file, image.string());
  EXPECT_EQ(summary.failures[0].stage, "photometric");
  EXPECT_EQ(summary.num_images_kept, 0);
  EXPECT_THAT(SummaryLine(summary), testing::MatchesRegex("4 of 5 images done in [0-9]+ s, 1 failed; depth at .*"));
  const std::string record = test_support::ReadBytes(folder_ / "stereo/phimvs.json");
  const auto run = nlohmann::json::parse(record)["runs"][0];
  EXPECT_EQ(run["images_kept"], 0);
  EXPECT_EQ(run["images_made"], kNumImages - 1);
  EXPECT_NEAR(run["images_per_second"].get<double>() * run["seconds"].get<double>(), kNumImages - 1, 1e-9);
  EXPECT_THAT(SummaryLine(Run()), testing::MatchesRegex("4 of 5 images done in [0-9]+ s, 4 of them kept from before, 1 failed; .*"));
  EXPECT_EQ(test_support::ReadBytes(folder_ / "stereo/phimvs.json"), record) << "no run worth a line";
  EXPECT_FALSE(std::filesystem::exists(DepthPath(1, "photometric")));
  EXPECT_TRUE(std::filesystem::exists(DepthPath(4, "geometric")));
  test_support::WriteBytes(image, bytes);
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(HashMaps(folder_.path()), CleanMaps());
}

TEST_F(StereoPipelineTest, StatusCountsImagesThatAreMissing) {
  const auto image = folder_ / "images" / names_[1];
  const std::string bytes = test_support::ReadBytes(image);
  std::filesystem::remove(image);
  Run();
  const RunStatus status = FindStatus(RunRecord(folder_ / "stereo"));
  EXPECT_EQ(status.num_images, kNumImages);
  ASSERT_THAT(status.failures, SizeIs(1));
  EXPECT_EQ(status.failures[0].image, names_[1]);
  EXPECT_THAT(status.failures[0].text, HasSubstr(image.string() + " is missing"));
  EXPECT_EQ(status.stages.back().num_failed, 1);
  test_support::WriteBytes(image, bytes);
  Run();
  EXPECT_THAT(FindStatus(RunRecord(folder_ / "stereo")).failures, SizeIs(0));
}

TEST_F(StereoPipelineTest, MapsStayDoneWhileTheirPhotoIsAway) {
  Run();
  std::filesystem::remove(folder_ / "images" / names_[1]);
  std::filesystem::remove(DepthPath(4, "photometric"));
  EXPECT_THAT(Run().failures, SizeIs(1));
  const auto record = RunRecord(folder_ / "stereo").Find(names_[1], "photometric");
  ASSERT_TRUE(record.has_value());
  EXPECT_EQ(record->state, "done");
  EXPECT_TRUE(std::filesystem::exists(DepthPath(1, "photometric")));
}

TEST_F(StereoPipelineTest, LinkToItselfFailsAlone) {
  const auto image = folder_ / "images" / names_[1];
  std::filesystem::remove(image);
  std::filesystem::create_symlink(image.filename(), image);
  const RunSummary summary = Run();
  ASSERT_THAT(summary.failures, SizeIs(1));
  EXPECT_EQ(summary.failures[0].image, names_[1]);
  EXPECT_TRUE(std::filesystem::exists(DepthPath(4, "geometric")));
}

// They are sources of the others in two stages, and fail themselves.
TEST_F(StereoPipelineTest, WhatTellsOfAFailureTellsNothingOfItAsASource) {
  std::filesystem::remove(folder_ / "images" / names_[1]);
  test_support::WriteBytes(folder_ / "images" / names_[2], "not a picture");
  const test_support::LogCapture log;
  Run();
  EXPECT_THAT(log.messages(), testing::Contains(HasSubstr(names_[2] + ": this image is damaged")).Times(1));
  EXPECT_THAT(log.messages(), testing::Not(testing::Contains(HasSubstr("left out"))));
  const auto record = RunRecord(folder_ / "stereo").Find(names_[4], "photometric");
  ASSERT_TRUE(record.has_value());
  const std::string left_out = "source image left out: " + (folder_ / "images").string() + "/";
  EXPECT_THAT(record->warnings, testing::UnorderedElementsAre(HasSubstr(left_out + names_[1] + ": this image is missing"),
                                                              HasSubstr(left_out + names_[2] + ": this image is damaged")));
}

// Nothing else tells why. Which image reads them first, and in what order, does not matter.
TEST_F(StereoPipelineTest, SourcesWithoutMapsOfTheirOwnAreToldOfOnceByTheirReasons) {
  test_support::WriteBytes(folder_ / "stereo/patch-match.cfg", names_[0] + "\n__all__\n" + names_[4] + "\n__all__\n");
  for (const int image : {1, 2}) std::filesystem::remove(folder_ / "images" / names_[image]);
  const std::string why = ": " + (folder_ / "images" / names_[1]).string() + ": this image is missing or cannot be opened; restore it";
  num_concurrent_ = 2;
  for (const bool is_late : {false, true}) {
    options_.overwrite = true;
    options_.stereo.seed = is_late ? 1 : 0;
    calls_.on_call = [&](const std::string&, const std::string& image) {
      if ((image == names_[0]) == is_late) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    };
    const test_support::LogCapture log;
    EXPECT_TRUE(Run().failures.empty());
    EXPECT_THAT(log.messages(),
                testing::Contains("source images were left out, since they cannot be read:\n  " + names_[1] + ", " + names_[2] + why));
    EXPECT_THAT(log.messages(), testing::Contains(HasSubstr(names_[1])).Times(1));
  }
  std::filesystem::remove(folder_ / "images" / names_[3]);
  options_.stereo.seed = 2;
  test_support::WriteBytes(folder_ / "stereo/patch-match.cfg", names_[0] + "\n" + names_[1] + "\n" + names_[4] + "\n" + names_[0] + "\n");
  const RunSummary alone = Run();
  ASSERT_THAT(alone.failures, SizeIs(1));
  EXPECT_THAT(alone.failures[0].text, HasSubstr(names_[0] + ": none of its source images can be read" + why));
}

// A run may go on for days after that, or be killed.
TEST_F(StereoPipelineTest, AFailureIsToldAndRecordedWhenItHappens) {
  test_support::WriteBytes(folder_ / "images" / names_[1], "not a picture");
  const test_support::LogCapture log;
  int num_filters = 0;
  calls_.on_filter = [&](const phi::FilterInput&) {
    if (++num_filters > 1) return;
    EXPECT_THAT(log.messages(), testing::Contains(HasSubstr(names_[1] + ": this image is damaged")));
    EXPECT_THAT(FindStatus(RunRecord(folder_ / "stereo")).failures, SizeIs(1));
  };
  EXPECT_THAT(Run().failures, SizeIs(1));
  EXPECT_GT(num_filters, 0);
}

// Maps of these stages are not recorded themselves.
TEST_F(StereoPipelineTest, StatusTellsOfAnImageThatCannotBeFilled) {
  for (const auto& [failing, kind] : std::map<std::string, std::string>{{"share", "measured"}, {"infer", "geometric"}}) {
    ++options_.stereo.seed;
    calls_.on_call = [&, failing = failing](const std::string& stage, const std::string& image) {
      if (stage == failing && image == names_[1]) throw phi::InputError("no luck");
    };
    ASSERT_THAT(Run().failures, SizeIs(1)) << failing;
    const RunStatus status = FindStatus(RunRecord(folder_ / "stereo"));
    ASSERT_THAT(status.failures, SizeIs(1)) << failing;
    EXPECT_EQ(status.failures[0].image, names_[1]);
    EXPECT_EQ(status.failures[0].stage, kind);
    EXPECT_EQ(status.failures[0].text, "no luck");
    EXPECT_EQ(status.stages.back().num_failed, 1) << failing;
    EXPECT_EQ(status.stages.back().num_waiting, 0) << failing;
    EXPECT_THAT(StatusText(status, LockUse::kFree), HasSubstr("failed: " + names_[1] + " (" + kind + "): no luck\n"));
  }
  calls_.on_call = nullptr;
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_THAT(FindStatus(RunRecord(folder_ / "stereo")).failures, SizeIs(0));
  EXPECT_EQ(HashMaps(folder_.path()), CleanMaps());
}

TEST_F(StereoPipelineTest, DamagedImageFailsAloneAndTheRestIsNotMadeTwice) {
  test_support::WriteBytes(folder_ / "images" / names_[1], "not a picture");
  const RunSummary first = Run();
  ASSERT_THAT(first.failures, SizeIs(1));
  EXPECT_EQ(first.failures[0].image, names_[1]);
  EXPECT_EQ(first.failures[0].stage, "photometric");
  EXPECT_EQ(first.failures[0].file, (folder_ / "images" / names_[1]).string());
  EXPECT_TRUE(std::filesystem::exists(DepthPath(0, "geometric")));
  calls_.estimates = calls_.filters = 0;
  EXPECT_THAT(Run().failures, SizeIs(1));
  EXPECT_EQ(calls_.estimates, 0);
  EXPECT_EQ(calls_.filters, 0);
}

// Uncompressed images keep their size whatever they show.
TEST_F(StereoPipelineTest, ImageReplacedByOneOfTheSameSizeIsDoneAgain) {
  const auto image = folder_ / "images" / names_[1];
  phi::GrayImage gray = ReadGrayImage(image);
  WriteGrayImage(folder_ / "uncompressed.bmp", gray);
  std::filesystem::rename(folder_ / "uncompressed.bmp", image);
  Run();
  calls_.estimates = 0;
  Run();
  EXPECT_EQ(calls_.estimates, 0);
  gray(12, 8) ^= 1;
  WriteGrayImage(folder_ / "uncompressed.bmp", gray);
  std::filesystem::rename(folder_ / "uncompressed.bmp", image);
  Run();
  EXPECT_EQ(calls_.estimates, kNumImages);  // each reads it
}

TEST_F(StereoPipelineTest, NothingDoneIsBadInput) {
  std::filesystem::remove(folder_ / "images" / names_[1]);
  EXPECT_EQ(Run().Code(), phi::ExitCode::kSomeImagesFailed);
  std::filesystem::remove_all(folder_ / "images");
  for (const bool allow_missing_files : {false, true}) {
    options_.allow_missing_files = allow_missing_files;
    const std::string path = (folder_ / "images" / names_[0]).string();
    const phi::Message message = test_support::WholeMessageOf<phi::InputError>([&] { Run(); });
    EXPECT_THAT(message.text, HasSubstr("no image can be done: image " + names_[0] + ": the file " + path + " is missing"));
    EXPECT_EQ(message.image, names_[0]);
    EXPECT_EQ(message.file, path);
    EXPECT_EQ(message.stage, "photometric");
  }
}

// The others are done, and too little memory for all is no bad input.
TEST_F(StereoPipelineTest, AnImageThatNoDeviceHoldsFailsAlone) {
  bool is_all = false;
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    if (stage == "infer" && (is_all || image == names_[1])) throw phi::TooLargeForDevice("image " + image + " is too large");
  };
  const RunSummary summary = Run();
  EXPECT_EQ(summary.Code(), phi::ExitCode::kSomeImagesFailed);
  ASSERT_EQ(summary.failures.size(), 1u);
  EXPECT_EQ(summary.failures[0].image, names_[1]);
  EXPECT_THAT(summary.failures[0].text, HasSubstr("is too large"));
  is_all = true;
  options_.overwrite = true;
  EXPECT_EQ(Run().Code(), phi::ExitCode::kOutOfResources);
}

// Two images have one witness each, and the filter asks for two.
TEST_F(StereoPipelineTest, SaysWhenTheFilterCanKeepNothing) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 2});
  const auto warnings =
      testing::Contains(HasSubstr("only what no source image contradicts will be kept of 2 of 2 images, a/0.png the first"));
  options_.filter.min_num_consistent = 2;
  {
    const test_support::LogCapture log;
    Run(folder.path());
    EXPECT_THAT(log.messages(), warnings);
  }
  options_.filter.min_num_consistent = 1;
  const test_support::LogCapture log;
  Run(folder.path());
  EXPECT_THAT(log.messages(), testing::Not(warnings));
}

TEST_F(StereoPipelineTest, NamesAnImageOfWhichNothingIsLeft) {
  const auto warning = testing::Contains(HasSubstr("maps of 1 of 5 images has depth, " + names_[3]));
  calls_.emptied = names_[3];
  {
    const test_support::LogCapture log;
    Run();
    EXPECT_THAT(log.messages(), warning);
  }
  calls_.emptied.clear();
  options_.stereo.seed = 1;
  const test_support::LogCapture log;
  Run();
  EXPECT_THAT(log.messages(), testing::Not(testing::Contains(HasSubstr("hardly a pixel"))));
}

TEST_F(StereoPipelineTest, AllowsMissingFilesWhenAsked) {
  std::filesystem::remove(folder_ / "images" / names_[1]);
  options_.allow_missing_files = true;
  const RunSummary summary = Run();
  EXPECT_TRUE(summary.failures.empty());
  EXPECT_EQ(summary.num_images, kNumImages - 1);
  EXPECT_EQ(summary.num_images_kept, 0);
  ASSERT_THAT(summary.left_out, SizeIs(1));
  EXPECT_EQ(summary.left_out[0].image, names_[1]);
  EXPECT_THAT(SummaryLine(Run()), HasSubstr("4 images: all maps are there and up to date, nothing to do"));
}

TEST_F(StereoPipelineTest, ErrorOfTheDeviceEndsTheRun) {
  calls_.on_call = [](const std::string&, const std::string&) {
    throw phi::ResourceError("out of device memory");
  };
  EXPECT_THROW(Run(), phi::ResourceError);
}

TEST_F(StereoPipelineTest, WithoutGeometricConsistencyThePhotometricMapsAreFiltered) {
  options_.geom_consistency = false;
  Run();
  EXPECT_EQ(calls_.filters, kNumImages);
  EXPECT_EQ(calls_.inferences, 0);
  EXPECT_THAT(HashMaps(folder_.path()), SizeIs(kNumImages * 2));  // the raw maps are gone
  EXPECT_EQ(ReadDepthMap(DepthPath(0, "photometric"))(7, 0), 0);  // the fake filter was here
  calls_.estimates = calls_.filters = 0;
  Run();
  EXPECT_EQ(calls_.estimates + calls_.filters, 0);
}

// A user's own file of such a name is in no record.
TEST_F(StereoPipelineTest, EstimatesOfAKilledRunGoAlsoAfterAChangeOfOptions) {
  options_.geom_consistency = false;
  calls_.on_call = [](const std::string& stage, const std::string&) {
    if (stage == "filter") throw std::runtime_error("killed");
  };
  EXPECT_THROW(Run(), std::runtime_error);
  calls_.on_call = nullptr;
  EXPECT_TRUE(std::filesystem::exists(DepthPath(1, "raw")));
  options_.geom_consistency = true;
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_EQ(HashMaps(folder_.path()), CleanMaps());
  const auto record = nlohmann::json::parse(test_support::ReadBytes(folder_ / "stereo/phimvs.json"));
  for (const std::string& name : names_) EXPECT_FALSE(record["images"][name].contains("raw")) << name;
  test_support::WriteBytes(DepthPath(1, "raw"), "foreign");
  Run();
  EXPECT_EQ(test_support::ReadBytes(DepthPath(1, "raw")), "foreign");
}

TEST_F(StereoPipelineTest, WithoutAnyFilterThePhotometricMapsAreTheEstimate) {
  options_.geom_consistency = false;
  options_.filter_maps = false;
  Run();
  EXPECT_EQ(calls_.filters, 0);
  EXPECT_GT(ReadDepthMap(DepthPath(0, "photometric"))(7, 0), 0);
}

TEST_F(StereoPipelineTest, WithoutInferenceTheGeometricMapsAreTheMeasuredOnes) {
  options_.inference.mode = phi::InferenceMode::kOff;
  Run();
  EXPECT_EQ(calls_.inferences, 0);
  const phi::DepthMap measured = ReadPublishedDepths(DepthPath(0, "measured"));  // without clues
  const phi::DepthMap geometric = ReadDepthMap(DepthPath(0, "geometric"));
  for (std::size_t i = 0; i < measured.size(); ++i) ASSERT_EQ(geometric.data()[i], measured.data()[i]);
}

// A plain image measures nothing, whatever comes after.
TEST_F(StereoPipelineTest, WhatIsMeasuredIsTheSameWithoutInference) {
  WriteGrayImage(folder_ / "images" / names_[0], phi::GrayImage(24, 16, std::uint8_t{128}));
  options_.inference.mode = phi::InferenceMode::kOff;
  Run();
  const auto is_hole = [](float depth) { return depth == 0; };
  EXPECT_EQ(phi::CountIf(ReadDepthMap(DepthPath(0, "measured")), is_hole), 24 * 16);
  EXPECT_EQ(phi::CountIf(ReadDepthMap(DepthPath(0, "geometric")), is_hole), 24 * 16);
  EXPECT_LT(phi::CountIf(ReadDepthMap(DepthPath(1, "measured")), is_hole), 24 * 16);
  const std::string measured = test_support::ReadBytes(DepthPath(1, "measured"));
  options_.inference.mode = phi::InferenceMode::kMrf;
  calls_.filters = 0;
  Run();
  EXPECT_EQ(test_support::ReadBytes(DepthPath(1, "measured")), measured);
  EXPECT_EQ(calls_.filters, kNumImages);  // of what was inferred; the measured maps are there
}

// A mask that stayed would be read with the new maps as what they fill, and be refused as another program's afterwards.
TEST_F(StereoPipelineTest, MasksAndCostsGoWithTheMapsThatTheyBelongTo) {
  for (const bool has_both : {true, false, true, false}) {
    options_.inference.mode = has_both ? phi::InferenceMode::kMrf : phi::InferenceMode::kOff;
    options_.write_cost_maps = has_both;
    const auto expected = CleanMaps();
    EXPECT_TRUE(Run().failures.empty());
    EXPECT_EQ(HashMaps(folder_.path()), expected) << has_both;
  }
}

TEST_F(StereoPipelineTest, AMaskOfAnotherProgramStaysOrIsReplacedAlsoWhereMapsHaveNone) {
  options_.inference.mode = phi::InferenceMode::kOff;
  const auto expected = CleanMaps();
  const auto mask = folder_ / "stereo/filled_masks" / (names_[2] + ".png");
  for (const bool is_empty_workspace : {true, false}) {
    WriteMask(mask, phi::Mask(24, 16, 255));
    const std::string foreign = test_support::ReadBytes(mask);
    options_.overwrite = false;
    EXPECT_THAT(test_support::InputErrorOf([&] { Run(); }), HasSubstr(mask.string() + " was not made by phimvs"));
    EXPECT_EQ(test_support::ReadBytes(mask), foreign) << is_empty_workspace;
    options_.overwrite = true;
    EXPECT_TRUE(Run().failures.empty());
    EXPECT_EQ(HashMaps(folder_.path()), expected) << is_empty_workspace;
  }
}

TEST_F(StereoPipelineTest, CostMapsOnRequest) {
  options_.write_cost_maps = true;
  Run();
  EXPECT_FLOAT_EQ(ReadDepthMap(folder_ / "stereo/cost_maps" / (names_[0] + ".photometric.bin"))(3, 3), 0.25f);
}

}  // namespace
}  // namespace colmap_ext

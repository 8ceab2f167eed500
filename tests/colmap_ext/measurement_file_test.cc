#include "colmap_ext/measurement_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "tests/support/error_message.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using phi::PixelState;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kWidth = 6;

// A workspace whose first image has maps of one row of six pixels: depths and the mask's values as given.
class MeasurementFileTest : public ::testing::Test {
 protected:
  MeasurementFileTest() { test_support::WriteNoiseWorkspace(folder_.path()); }

  void Write(const std::string& kind, const std::vector<float>& depths,
             const std::vector<std::uint8_t>& values) const {
    phi::PlaneMap map(kWidth, 1);
    phi::Mask mask(static_cast<int>(values.size()), 1);
    for (int x = 0; x < kWidth; ++x) map(x, 0) = {{0, 0, -1}, depths[x]};
    for (std::size_t x = 0; x < values.size(); ++x) mask.data()[x] = values[x];
    const Workspace workspace = Open();
    WritePlaneMap(workspace.DepthMapPath(0, kind), workspace.NormalMapPath(0, kind), map);
    if (!values.empty()) WriteMask(workspace.FilledMaskPath(0, kind), mask);
  }
  Workspace Open() const { return Workspace({.path = folder_.path()}); }

  // By both readers, which must agree.
  void ExpectStates(const std::string& kind, const std::vector<PixelState>& states,
                    const std::vector<float>& depths) const {
    const phi::MeasurementMap map = ReadMeasurements(Open(), 0, kind);
    const phi::MeasuredDepths alone = ReadMeasuredDepths(Open(), 0, kind);
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_EQ(map.states(x, 0), states[x]) << kind << " " << x;
      EXPECT_EQ(alone.states(x, 0), states[x]) << kind << " " << x;
      EXPECT_EQ(map.planes(x, 0).depth, depths[x]) << kind << " " << x;
      EXPECT_EQ(alone.depths(x, 0), depths[x]) << kind << " " << x;
    }
  }

  test_support::TemporaryFolder folder_;
};

TEST_F(MeasurementFileTest, TheMaskSaysWhatThePixelsOfAMeasuredMapAre) {
  const std::vector<float> depths = {1, 2, 3, 0, 0, 0};
  Write("measured", depths, {0, 128, 255, 0, 128, 255});
  ExpectStates("measured",
               {PixelState::kMeasured, PixelState::kClue, PixelState::kMeasured, PixelState::kNone,
                PixelState::kNone, PixelState::kNone},
               depths);
  Write("inferred", depths, {0, 128, 255, 0, 128, 255});
  ExpectStates("inferred",
               {PixelState::kMeasured, PixelState::kInferredAlone, PixelState::kInferredConfirmed,
                PixelState::kNone, PixelState::kNone, PixelState::kNone},
               depths);
}

TEST_F(MeasurementFileTest, NegativeDepthsOfEarlierVersionsAreClues) {
  Write("measured", {1, -2, 3, 0, -5, 6}, {0, 0, 255, 0, 0, 0});
  ExpectStates("measured",
               {PixelState::kMeasured, PixelState::kClue, PixelState::kMeasured, PixelState::kNone,
                PixelState::kClue, PixelState::kMeasured},
               {1, 2, 3, 0, 5, 6});
}

TEST_F(MeasurementFileTest, StatesComeBackFromTheirMask) {
  const std::vector<PixelState> measured = {PixelState::kMeasured, PixelState::kClue, PixelState::kClue,
                                            PixelState::kNone,     PixelState::kMeasured, PixelState::kClue};
  phi::StateMap states(kWidth, 1);
  std::vector<float> depths(kWidth);
  for (int x = 0; x < kWidth; ++x) {
    states(x, 0) = measured[x];
    depths[x] = measured[x] == PixelState::kNone ? 0.0f : 2.0f;
  }
  const phi::Mask mask = MaskOfStates(states);
  Write("measured", depths, {mask.begin(), mask.end()});
  ExpectStates("measured", measured, depths);
}

TEST_F(MeasurementFileTest, AnEstimateHasNoStates) {
  Write("photometric", {1, 2, 3, 4, 5, 6}, {});
  EXPECT_TRUE(ReadMeasurements(Open(), 0, "photometric").states.empty());
  EXPECT_TRUE(ReadMeasuredDepths(Open(), 0, "photometric").states.empty());
}

TEST_F(MeasurementFileTest, AMaskOfAnotherSizeIsAnError) {
  Write("measured", {1, 2, 3, 4, 5, 6}, {0, 0, 0});
  const Workspace workspace = Open();
  const std::string path = workspace.FilledMaskPath(0, "measured").string();
  EXPECT_THAT(test_support::InputErrorOf([&] { ReadMeasurements(workspace, 0, "measured"); }),
              AllOf(HasSubstr(path), HasSubstr("size of its map")));
  fs::remove(path);
  EXPECT_THAT(test_support::InputErrorOf([&] { ReadMeasurements(workspace, 0, "measured"); }),
              HasSubstr(path));
}

TEST_F(MeasurementFileTest, WhoTakesAllDepthsForDepthsGetsNoClues) {
  const auto read = [&](const std::string& kind) {
    const phi::DepthMap depths = ReadPublishedDepths(Open().DepthMapPath(0, kind));
    return std::vector<float>(depths.begin(), depths.end());
  };
  const std::vector<float> depths = {1, 2, 3, 0, 5, 6};
  for (const std::string kind : {"measured", "photometric"}) Write(kind, depths, {0, 128, 255, 0, 128, 0});
  EXPECT_EQ(read("measured"), (std::vector<float>{1, 0, 3, 0, 0, 6}));
  EXPECT_EQ(read("photometric"), depths);
  EXPECT_EQ(FindPublishedDepths(Open(), 0, "measured", 1)->depths(1, 0), 0);
  fs::remove(Open().FilledMaskPath(0, "measured"));
  EXPECT_EQ(read("measured"), depths);
}

TEST_F(MeasurementFileTest, SomeRowsHaveNoCluesEither) {
  const Workspace workspace = Open();
  phi::PlaneMap map(2, 12, {{0, 0, -1}, 3});
  phi::Mask mask(2, 12);
  mask(0, 2) = mask(1, 6) = mask(0, 7) = 128;  // of the rows 2, 6 and 10 that are read
  WritePlaneMap(workspace.DepthMapPath(0, "measured"), workspace.NormalMapPath(0, "measured"), map);
  WriteMask(workspace.FilledMaskPath(0, "measured"), mask);
  const auto rows = FindPublishedDepths(workspace, 0, "measured", 3);
  ASSERT_TRUE(rows);
  EXPECT_EQ(std::vector<float>(rows->depths.begin(), rows->depths.end()), (std::vector<float>{0, 3, 3, 0, 3, 3}));
  EXPECT_EQ(rows->map_height, 12);
}

// The file ends with six planes of eight bytes, which are as they are: two of depth, three of normals, states.
TEST_F(MeasurementFileTest, DamageOfACompactMapIsFoundWhereItIsRead) {
  const Workspace workspace = Open();
  const fs::path path = CompactMapPath(workspace, 0, "measured");
  const phi::MeasurementMap map{phi::PlaneMap(4, 2, {{0, 0, -1}, 3}), phi::StateMap(4, 2, PixelState::kMeasured)};
  std::vector<std::uint8_t> bytes = EncodeCompactMap(map);
  const auto write = [&] {
    fs::create_directories(path.parent_path());
    test_support::WriteBytes(path, std::string(bytes.begin(), bytes.end()));
  };
  const auto problem = [&](int max_rows) {
    return test_support::InputErrorOf([&] { FindPublishedDepths(workspace, 0, "measured", max_rows); });
  };
  std::fill(bytes.end() - 32, bytes.end() - 8, std::uint8_t{255});
  write();
  EXPECT_THAT(test_support::InputErrorOf([&] { ReadMeasurements(workspace, 0, "measured"); }), HasSubstr(path.string()));
  for (const int max_rows : {1, kAllRows})
    EXPECT_EQ(FindPublishedDepths(workspace, 0, "measured", max_rows)->depths(0, 0), 3) << "without normals";
  bytes = EncodeCompactMap(map);
  std::fill(bytes.end() - 8, bytes.end(), std::uint8_t{9});
  write();
  for (const int max_rows : {1, kAllRows}) EXPECT_THAT(problem(max_rows), HasSubstr(path.string())) << max_rows;
}

}  // namespace
}  // namespace colmap_ext

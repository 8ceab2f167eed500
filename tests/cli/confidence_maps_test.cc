// dense and stereo_fusion with --PhiFusion.write_confidence_maps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "colmap_ext/map_file.h"
#include "tests/support/room_run.h"
#include "tests/support/run_on_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using test_support::ProgramResult;
using test_support::RoomRun;
using test_support::RunOnWorkspace;
using testing::HasSubstr;

const std::vector<std::string> kOn = {"--PhiFusion.write_confidence_maps", "1", "--PhiFusion.backend", "cpu"};

std::vector<std::string> And(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// How often a right pixel has a higher value than a wrong one, of all pairs.
double Area(const std::vector<float>& right, std::vector<float> wrong) {
  std::sort(wrong.begin(), wrong.end());
  double sum = 0;
  for (const float value : right) {
    const auto [less, more] = std::equal_range(wrong.begin(), wrong.end(), value);
    sum += 0.5 * static_cast<double>((less - wrong.begin()) + (more - wrong.begin()));
  }
  return sum / (static_cast<double>(right.size()) * static_cast<double>(wrong.size()));
}

class ConfidenceMapsCommand : public testing::Test {
 protected:
  fs::path Folder() const { return run_.dense() / "stereo/confidence_maps"; }
  std::map<std::string, std::string> ReadMaps() const {
    std::map<std::string, std::string> maps;
    for (const auto& file : fs::directory_iterator(Folder())) maps[file.path().filename()] = test_support::ReadBytes(file.path());
    return maps;
  }

  const RoomRun run_{colmap_ext::MakeSyntheticRoom({.width = 160, .height = 120, .num_views = 5})};
};

TEST_F(ConfidenceMapsCommand, DenseWritesThoseOfFusionAndShowsThemAndRightPixelsHaveHigherValues) {
  const ProgramResult made = RunOnWorkspace("dense", run_.dense(), kOn);
  ASSERT_EQ(made.exit_code, 0) << made.errors;
  EXPECT_THAT(made.errors, HasSubstr("stereo/confidence_maps"));
  EXPECT_THAT(test_support::ReadBytes(run_.dense() / "report.html"), HasSubstr("how probably the final depth is right"));
  const auto maps = ReadMaps();
  EXPECT_EQ(maps.size(), 5u);
  EXPECT_THAT(test_support::RunProgram({PHIMVS_BINARY, "map_inspector", "--input_path", Folder()}).output,
              HasSubstr(" %, confidence median 0."));
  fs::remove_all(Folder());
  const auto fuse = [&](const std::vector<std::string>& shard) {
    return test_support::RunProgram(And(And({PHIMVS_BINARY, "stereo_fusion", "--workspace_path", run_.dense(), "--output_path",
                                             run_.dense() / "again.ply"},
                                            kOn),
                                        shard));
  };
  ASSERT_EQ(fuse({}).exit_code, 0);
  EXPECT_TRUE(ReadMaps() == maps) << "of maps in files";
  fs::remove_all(Folder());
  ASSERT_EQ(fuse({"--shard", "0/1"}).exit_code, 0);
  EXPECT_TRUE(ReadMaps() == maps) << "of a shard";

  std::vector<float> right, wrong;
  for (int view = 0; view < run_.num_views(); ++view) {
    const std::string name = run_.scene().views[static_cast<std::size_t>(view)].name + ".geometric.bin";
    const phi::Array2D<float> confidence = colmap_ext::ReadDepthMap(Folder() / name), depth = run_.Depth(view, "geometric");
    const phi::PlaneMap& truth = *run_.scene().truth[static_cast<std::size_t>(view)];
    ASSERT_EQ(confidence.size(), depth.size());
    for (std::size_t i = 0; i < depth.size(); ++i) {
      ASSERT_EQ(confidence.data()[i] > 0, depth.data()[i] > 0);
      if (!(depth.data()[i] > 0)) continue;
      const float exact = truth.data()[i].depth;
      (std::abs(depth.data()[i] - exact) <= 0.005f * exact ? right : wrong).push_back(confidence.data()[i]);
    }
  }
  const double area = Area(right, wrong);
  std::printf("%zu right, %zu wrong, area %.3f\n", right.size(), wrong.size(), area);
  EXPECT_GT(wrong.size(), 1000u);
  EXPECT_GT(area, 0.65);  // 0.69; of 480 x 360 pixels, whose plain walls are less often off as a whole, 0.85
}

TEST_F(ConfidenceMapsCommand, RefusesWhatWouldLeaveNoneBeforeTheStereo) {
  const ProgramResult nothing_kept = RunOnWorkspace("dense", run_.dense(), And(kOn, {"--keep", "cloud"}));
  EXPECT_EQ(nothing_kept.exit_code, 1);
  EXPECT_THAT(nothing_kept.errors, HasSubstr("--keep cloud leaves no maps"));
  const ProgramResult paper = RunOnWorkspace("dense", run_.dense(), And(kOn, {"--PhiFusion.formulas", "paper"}));
  EXPECT_EQ(paper.exit_code, 1);
  EXPECT_THAT(paper.errors, HasSubstr("--PhiFusion.formulas paper"));
  const ProgramResult smaller = RunOnWorkspace("dense", run_.dense(), And(kOn, {"--StereoFusion.max_image_size", "80"}));
  EXPECT_EQ(smaller.exit_code, 1);
  EXPECT_THAT(smaller.errors, HasSubstr("--StereoFusion.max_image_size"));
  EXPECT_FALSE(fs::exists(run_.dense() / "stereo/phimvs.json"));
}

// They would be of maps that are gone.
TEST_F(ConfidenceMapsCommand, GoWithTheMapsThatTheyAreOf) {
  std::vector<std::string> fast = {"--PhiStereo.quality", "fast", "--PhiInference.mode", "off"};
  ASSERT_EQ(RunOnWorkspace("dense", run_.dense(), And(kOn, fast)).exit_code, 0);
  ASSERT_EQ(RunOnWorkspace("patch_match_stereo", run_.dense(), fast).exit_code, 0);
  EXPECT_EQ(ReadMaps().size(), 5u) << "no map is made again";
  // The others' rest on it.
  const std::string first = run_.scene().views.front().name;
  test_support::WriteBytes(Folder() / (first + ".photometric.bin"), "of maps that stay");
  fs::remove(run_.dense() / "stereo/depth_maps" / (first + ".geometric.bin"));
  const ProgramResult one_again = RunOnWorkspace("patch_match_stereo", run_.dense(), fast);
  ASSERT_EQ(one_again.exit_code, 0);
  EXPECT_THAT(one_again.errors, HasSubstr("5 confidence maps are removed, since geometric maps that they rest on change"));
  ASSERT_EQ(ReadMaps().size(), 1u);
  fs::remove(Folder() / (first + ".photometric.bin"));
  ASSERT_EQ(RunOnWorkspace("dense", run_.dense(), And(kOn, fast)).exit_code, 0);
  fast.back() = "min_cost";
  ASSERT_EQ(RunOnWorkspace("patch_match_stereo", run_.dense(), fast).exit_code, 0);
  EXPECT_TRUE(ReadMaps().empty());
  ASSERT_EQ(RunOnWorkspace("dense", run_.dense(), And(kOn, fast)).exit_code, 0);
  EXPECT_EQ(ReadMaps().size(), 5u);
  ASSERT_EQ(RunOnWorkspace("dense", run_.dense(), And(fast, {"--keep", "cloud"})).exit_code, 0);
  EXPECT_TRUE(ReadMaps().empty());
}

}  // namespace

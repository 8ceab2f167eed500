#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "tests/support/run_on_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using test_support::ProgramResult;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using testing::HasSubstr;

class DenseCommand : public testing::Test {
 protected:
  DenseCommand() { test_support::MakeRoom(folder_.path(), 120, 90, 4); }

  std::vector<std::string> Command(const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> command{PHIMVS_BINARY, name, "--workspace_path", folder_ / "room/dense"};
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }
  ProgramResult Dense(const std::vector<std::string>& more) { return RunProgram(Command("dense", more)); }

  TemporaryFolder folder_;
};

TEST_F(DenseCommand, GoesFromWorkspaceToCloudAndReport) {
  const ProgramResult result = Dense(
      {"--PhiStereo.quality", "fast", "--StereoFusion.min_num_pixels", "2", "--default_random_seed", "3"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto cloud = folder_ / "room/dense/fused.ply";
  ASSERT_TRUE(std::filesystem::exists(cloud)) << result.errors;
  // 120 x 90 pixels seen from four places: a cloud of a few points would mean that the steps did not fit together.
  EXPECT_GT(colmap_ext::PlyRows(cloud).Find("vertex")->count, 1000u);
  const std::string record = test_support::ReadBytes(folder_ / "room/dense/stereo/phimvs.json");
  EXPECT_THAT(record, HasSubstr("\"PhiStereo.quality\": \"fast\"")) << "the option reached the stereo step";
  EXPECT_THAT(record, HasSubstr("\"default_random_seed\": \"3\""));
  EXPECT_THAT(test_support::ReadBytes(folder_ / "room/dense/report.html"), HasSubstr("\"num_shown\""));
}

TEST_F(DenseCommand, PhotosOf12BitsInFilesOf16AreTold) {
  std::string photo = "P5 120 90 65535\n";
  for (int i = 0; i < 120 * 90; ++i) photo += {'\x0F', static_cast<char>(i)};
  test_support::WriteBytes(folder_ / "room/dense/images/room0000.png", photo);
  EXPECT_THAT(Dense({"--PhiStereo.quality", "fast"}).errors,
              HasSubstr("1 of 3 photos looked at, room0000.png the first, have 16 bits but no value above 4095 of 65535"));
}

// They came out after hours of stereo.
TEST_F(DenseCommand, MistakesInWhatFusionReadsAreToldBeforeTheStereo) {
  const std::filesystem::path stereo = folder_ / "room/dense/stereo";
  const ProgramResult without_masks = Dense({"--StereoFusion.mask_path", folder_ / "nowhere"});
  EXPECT_EQ(without_masks.exit_code, 2);
  EXPECT_THAT(without_masks.errors, HasSubstr("--StereoFusion.mask_path: there is no folder"));
  EXPECT_FALSE(std::filesystem::exists(stereo / "phimvs.json"));
  test_support::WriteBytes(stereo / "fusion.cfg", "room0000.png\nroom9999.png\n");
  const ProgramResult wrong_name = Dense({});
  EXPECT_EQ(wrong_name.exit_code, 2);
  EXPECT_THAT(wrong_name.errors, HasSubstr("fusion.cfg: line 2: image 'room9999.png' is not in the sparse model"));
  EXPECT_FALSE(std::filesystem::exists(stereo / "phimvs.json"));
}

// An earlier run left fused.ply of one point; LAS and tiles are no PLY that a page could show.
TEST_F(DenseCommand, TheReportIsOfThisRunsCloudAlone) {
  const std::filesystem::path dense = folder_ / "room/dense", page = dense / "report.html";
  test_support::WriteBytes(dense / "fused.ply",
                           "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                           "end_header\n0 0 2\n");
  test_support::WriteBytes(dense / "fused.ply.json", R"({"points": 1, "images": 9, "seconds": 1, "pixels": {}})");
  struct Case {
    std::vector<std::string> options;
    std::filesystem::path fusion, named;
  };
  const std::filesystem::path las = folder_ / "c.las", tiles = folder_ / "c.ply";
  for (const Case& c : {Case{{"--output_path", las}, "c.las.json", "c.las"},
                        Case{{"--output_path", tiles, "--tile_size", "2"}, "c.ply.json", "c.tiles.json"}}) {
    std::vector<std::string> options = {"--PhiStereo.quality", "fast"};
    options.insert(options.end(), c.options.begin(), c.options.end());
    const ProgramResult result = Dense(options);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    const std::string html = test_support::ReadBytes(page), mark = "<script id=\"data\" type=\"application/json\">";
    const std::size_t begin = html.find(mark) + mark.size();
    const auto data = nlohmann::json::parse(html.substr(begin, html.find("</script>", begin) - begin));
    EXPECT_FALSE(data.contains("cloud")) << data["cloud"]["file"];
    EXPECT_EQ(data.value("cloud_not_shown", ""), (folder_ / c.named).string());
    EXPECT_EQ(data["fusion"], nlohmann::json::parse(test_support::ReadBytes(folder_ / c.fusion)));
    EXPECT_GT(data["fusion"]["points"], 1000);
  }
}

TEST_F(DenseCommand, TheCloudIsTheOneOfTheMapsInFiles) {
  struct Case {
    const char* name;
    std::vector<std::string> stereo, fusion;
    int num_from_memory;
  };
  const std::filesystem::path dense = folder_ / "room/dense", masks = folder_ / "masks";
  phi::Mask left_half(120, 90, 255);
  for (int y = 0; y < 90; ++y) std::fill_n(&left_half(60, y), 60, std::uint8_t{0});
  for (const auto& photo : std::filesystem::directory_iterator(dense / "images"))
    colmap_ext::WriteGrayImage(masks / (photo.path().filename().string() + ".png"), left_half);
  const std::vector<Case> cases = {
      {"enough memory", {}, {}, 4},
      {"a cache of 10 kB", {"--PatchMatchStereo.cache_size", "0.00001"}, {}, 0},
      {"memory for fusion alone", {}, {"--PhiFusion.max_memory_gb", "0.0006"}, 0},
      {"smaller maps than photos", {"--PatchMatchStereo.max_image_size", "100"}, {}, 4},
      {"smaller points than maps", {}, {"--StereoFusion.max_image_size", "60"}, 4},
      {"other maps than the last", {}, {"--input_type", "measured"}, 0},
      {"nothing inferred", {"--PhiInference.mode", "off"}, {}, 4},
      {"compact maps", {"--keep", "maps"}, {}, 4},
      {"compact maps in files", {"--keep", "maps"}, {"--input_type", "measured"}, 0},
      {"masks", {}, {"--StereoFusion.mask_path", masks}, 4},
  };
  const auto cloud = [&](const std::string& name) {
    return test_support::ReadBytes(dense / name) + test_support::ReadBytes(dense / (name + ".vis"));
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    for (const char* maps : {"depth_maps", "filled_masks", "compact_maps"})  // a map that is there already is not in memory
      std::filesystem::remove_all(dense / "stereo" / maps);
    std::vector<std::string> options = {"--PhiStereo.quality", "fast", "--log_level", "3"};
    options.insert(options.end(), c.stereo.begin(), c.stereo.end());
    options.insert(options.end(), c.fusion.begin(), c.fusion.end());
    const ProgramResult made = Dense(options);
    ASSERT_EQ(made.exit_code, 0) << made.errors;
    EXPECT_THAT(made.errors, HasSubstr(" " + std::to_string(c.num_from_memory) + " maps come from memory"));
    options = {"--output_path", dense / "again.ply"};
    options.insert(options.end(), c.fusion.begin(), c.fusion.end());
    const ProgramResult fused = test_support::RunProgram(Command("stereo_fusion", options));
    ASSERT_EQ(fused.exit_code, 0) << fused.errors;
    EXPECT_TRUE(cloud("fused.ply") == cloud("again.ply"));
    EXPECT_GT(cloud("fused.ply").size(), 20000u);
  }
}

TEST_F(DenseCommand, KeepsWhatItIsAskedToKeep) {
  const std::filesystem::path dense = folder_ / "room/dense";
  const auto made = [&](const std::string& keep) {
    const ProgramResult result = Dense({"--PhiStereo.quality", "fast", "--keep", keep});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_THAT(test_support::ReadBytes(dense / "report.html"), HasSubstr("Raw depth")) << "which reads all maps";
    return test_support::ReadMaps(dense);
  };
  const auto all = made("all");
  EXPECT_EQ(all.size(), 4u * 8) << "depth and normals of three kinds, masks of two";
  const std::string cloud = test_support::ReadBytes(dense / "fused.ply");
  EXPECT_EQ(made("cloud").size(), 0u);
  EXPECT_TRUE(test_support::ReadBytes(dense / "fused.ply") == cloud);
  const auto maps = made("maps");
  EXPECT_EQ(maps.size(), 4u * 5) << "two compact maps, the geometric one and its mask";
  EXPECT_TRUE(test_support::ReadBytes(dense / "fused.ply") == cloud);
  for (const auto& [path, bytes] : maps) {
    if (path.ends_with(".map")) {
      EXPECT_LT(bytes.size(), 5u * 120 * 90) << path;
    } else {
      EXPECT_TRUE(all.at(path) == bytes) << path;
    }
  }
  EXPECT_TRUE(made("all") == all) << "compact maps take COLMAP's form where that is asked for";
}

TEST_F(DenseCommand, RefusesAMistakeInFusionsOptionsBeforeTheStereo) {
  const ProgramResult result = Dense({"--StereoFusion.min_num_pixels", "-5"});
  EXPECT_EQ(result.exit_code, 1) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("min_num_pixels"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "room/dense/stereo/phimvs.json"));
}

TEST_F(DenseCommand, WithoutGeometricConsistencyFusesThePhotometricMaps) {
  const std::vector<std::string> photometric = {"--PatchMatchStereo.geom_consistency", "false", "--PhiStereo.quality", "fast"};

  const ProgramResult result = Dense(photometric);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("photometric maps are fused"));
  EXPECT_GT(colmap_ext::PlyRows(folder_ / "room/dense/fused.ply").Find("vertex")->count, 1000u);
}

// They would be another run's.
TEST_F(DenseCommand, MapsThatAreNotMadeAreNotFused) {
  struct Case {
    std::string option, kind;
  };
  for (const Case& c : {Case{"--PatchMatchStereo.geom_consistency", "geometric"}, Case{"--PatchMatchStereo.geom_consistency", "measured"},
                        Case{"--PatchMatchStereo.filter", "measured"}}) {
    const ProgramResult refused = Dense({c.option, "false", "--input_type", c.kind});
    EXPECT_EQ(refused.exit_code, 1) << refused.errors;
    EXPECT_THAT(refused.errors, HasSubstr("--input_type " + c.kind + ": with " + c.option + " false"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "room/dense/stereo/phimvs.json")) << "before the stereo";
  }
}

TEST_F(DenseCommand, NothingIsFilledBeyondTheDepthsThatWereGiven) {
  constexpr float kFarthest = 3.7f * 1.0001f;  // maps are rounded; the room's back wall is partly farther
  const ProgramResult result = Dense({"--PatchMatchStereo.depth_min", "1", "--PatchMatchStereo.depth_max", "3.7"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, testing::Not(HasSubstr("sparse points; nine in ten")));
  std::int64_t num_filled = 0;
  for (const auto& mask : std::filesystem::recursive_directory_iterator(folder_ / "room/dense/stereo/filled_masks"))
    num_filled += mask.is_regular_file();
  EXPECT_GT(num_filled, 0);
  for (const auto& file : std::filesystem::directory_iterator(folder_ / "room/dense/stereo/depth_maps")) {
    if (file.path().string().find(".geometric.bin") == std::string::npos) continue;
    const phi::DepthMap depths = colmap_ext::ReadDepthMap(file.path());
    EXPECT_GT(*std::max_element(depths.begin(), depths.end()), 3.0f);
    EXPECT_LE(*std::max_element(depths.begin(), depths.end()), kFarthest) << file.path();
  }
}

TEST_F(DenseCommand, TheReportReplacesNeitherTheCloudNorAnotherFile) {
  const std::string cloud = folder_ / "c.ply", other = folder_ / "images.bin";
  test_support::WriteBytes(other, "a model");
  const ProgramResult one_name = Dense({"--output_path", cloud, "--report_path", (folder_ / "." / "c.ply").string()});
  EXPECT_EQ(one_name.exit_code, 1);
  EXPECT_THAT(one_name.errors, HasSubstr("--report_path and --output_path are both " + cloud));
  const ProgramResult dense = Dense({"--report_path", other});
  EXPECT_EQ(dense.exit_code, 1);
  EXPECT_THAT(dense.errors, HasSubstr(other + " is no report, and would be replaced by one; choose another name, or move it away"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "room/dense/stereo/phimvs.json")) << "before the stereo";
  const ProgramResult report = test_support::RunProgram(
      {PHIMVS_BINARY, "report", "--workspace_path", folder_ / "room/dense", "--output_path", other});
  EXPECT_EQ(report.exit_code, 1) << report.errors;
  EXPECT_EQ(test_support::ReadBytes(other), "a model");
}

// The room in millimetres. What is made of it is the user's, since the range may be meant.
TEST_F(DenseCommand, DepthsThatWereGivenInAnotherUnitAreToldOf) {
  const ProgramResult result = Dense({"--PatchMatchStereo.depth_min", "1000", "--PatchMatchStereo.depth_max", "3700"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.errors, HasSubstr("warning: --PatchMatchStereo.depth_min and depth_max, 1000 to 3700, hold 0.0 % of the sparse"));
}

}  // namespace

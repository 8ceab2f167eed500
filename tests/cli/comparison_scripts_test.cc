// scripts/compare_with_colmap, ablation, eth3d and tanks_and_temples on a synthetic room. Stereo and fusion are stand-ins that hand over the
// room's exact maps and points, so that what is tested is the scripts; evaluate and report are the real ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "colmap_ext/map_file.h"
#include "colmap_ext/sparse_model.h"
#include "colmap_ext/workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using colmap_ext::Workspace;
using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using testing::HasSubstr;
using testing::Not;

namespace fs = std::filesystem;

void WriteProgram(const fs::path& path, const std::string& body) {
  WriteBytes(path, "#!/bin/sh\n" + body);
  fs::permissions(path, fs::perms::owner_all);
}

void WritePly(const fs::path& path, const std::vector<Eigen::Vector3d>& points) {
  std::string body;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3f f = p.cast<float>();
    body.append(reinterpret_cast<const char*>(f.data()), 12);
  }
  WriteBytes(path, "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.size()) +
                       "\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + body);
}

// A room rendered once for all tests: workspace room/dense, exact maps room/truth.
class ComparisonScripts : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    room_ = new TemporaryFolder();
    const ProgramResult result = RunProgram({PHIMVS_BINARY, "make_scene", "--output_path", *room_ / "room",
                                             "--width", "160", "--height", "120", "--num_views", "4"});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  static void TearDownTestSuite() { delete room_; }

  void SetUp() override {
    if (RunProgram({"python3", "--version"}).exit_code != 0) GTEST_SKIP() << "no python3 on PATH";
    Workspace workspace({*room_ / "room/dense"});
    for (std::size_t i = 0; i < workspace.views().size(); ++i) {
      std::vector<Eigen::Vector3d> in_camera = CameraPoints(workspace, static_cast<int>(i));
      const phi::Pose& pose = workspace.views()[i].camera.pose;
      for (const Eigen::Vector3d& p : in_camera) {
        world_.push_back(pose.rotation.transpose() * (p - pose.translation));
      }
      scans_.push_back(std::move(in_camera));
    }
    WritePly(folder_ / "exact.ply", world_);
    // patch_match_stereo leaves the exact maps, stereo_fusion the exact points; the rest is the real program.
    WriteProgram(folder_ / "phimvs", "echo \"$*\" >> '" + (folder_ / "calls").string() +
                                         "'\n"
                                         "case $1 in\n"
                                         "patch_match_stereo) workspace=$3; cd '" +
                                         TruthDepths().string() +
                                         "'; for f in *; do for k in photometric geometric; do cp \"$f\" "
                                         "\"$workspace/stereo/depth_maps/${f%.bin}.$k.bin\"; done; done ;;\n"
                                         "stereo_fusion) cp '" +
                                         (folder_ / "exact.ply").string() +
                                         "' \"$5\"; echo {} > \"$5.json\" ;;\n"
                                         "*) exec '" PHIMVS_BINARY "' \"$@\" ;;\nesac\n");
  }

  // The folder of the exact depth maps, files <image name>.bin.
  fs::path TruthDepths() const {
    const fs::path link = folder_ / "truth_depths";
    if (fs::exists(link)) return link;
    fs::create_directories(link);
    for (const auto& entry : fs::recursive_directory_iterator(*room_ / "room/truth")) {
      if (entry.path().string().find("depth") == std::string::npos || entry.path().extension() != ".bin")
        continue;
      std::string name = entry.path().stem().string();
      if (name.ends_with(".geometric")) name.resize(name.size() - 10);
      fs::copy_file(entry.path(), link / (name + ".bin"));
    }
    return link;
  }

  std::vector<Eigen::Vector3d> CameraPoints(const Workspace& workspace, int view) const {
    const phi::Pinhole k = workspace.views()[view].camera.pinhole;
    const auto depth = colmap_ext::ReadDepthMap(TruthDepths() / (workspace.views()[view].name + ".bin"));
    std::vector<Eigen::Vector3d> points;
    for (int y = 0; y < depth.height(); ++y) {
      for (int x = 0; x < depth.width(); ++x) {
        const double z = depth(x, y);
        if (z > 0) points.emplace_back((x + 0.5 - k.cx) / k.fx * z, (y + 0.5 - k.cy) / k.fy * z, z);
      }
    }
    return points;
  }

  ProgramResult Script(const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"python3", PHIMVS_SOURCE_DIR "/scripts/" + name});
    return RunProgram(arguments);
  }

  static TemporaryFolder* room_;
  TemporaryFolder folder_;
  std::vector<Eigen::Vector3d> world_;               // all views' points
  std::vector<std::vector<Eigen::Vector3d>> scans_;  // by view, camera frame
};

TemporaryFolder* ComparisonScripts::room_ = nullptr;

TEST_F(ComparisonScripts, Eth3dScoresASceneOfItsLayoutAndResumes) {
  const fs::path scene = folder_ / "data/tiny";
  fs::create_directories(scene);
  fs::copy(*room_ / "room/dense/images", scene / "images", fs::copy_options::recursive);
  const colmap_ext::SparseModel model = colmap_ext::ReadSparseModel(*room_ / "room/dense/sparse");
  fs::create_directories(scene / "dslr_calibration_undistorted");
  colmap_ext::WriteSparseModelText(model, scene / "dslr_calibration_undistorted");
  // One laser scan from each camera's place: its frame is the camera's.
  const Workspace workspace({*room_ / "room/dense"});
  std::string project = "<MeshLabProject><MeshGroup>\n";
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    const std::string name = "scan" + std::to_string(i) + ".ply";
    WritePly(scene / "dslr_scan_eval" / name, scans_[i]);
    const phi::Pose& pose = workspace.views()[i].camera.pose;
    Eigen::Matrix4d world_from_scan = Eigen::Matrix4d::Identity();
    world_from_scan.topLeftCorner<3, 3>() = pose.rotation.transpose();
    world_from_scan.topRightCorner<3, 1>() = pose.Center();
    std::ostringstream matrix;
    matrix.precision(17);
    matrix << world_from_scan;
    project += "<MLMesh label=\"" + name + "\" filename=\"" + name + "\">\n<MLMatrix44>\n" + matrix.str() +
               "\n</MLMatrix44>\n</MLMesh>\n";
  }
  WriteBytes(scene / "dslr_scan_eval/scan_alignment.mlp", project + "</MeshGroup></MeshLabProject>\n");

  const std::vector<std::string> arguments{"--data_path",   folder_ / "data", "--output_path",
                                           folder_ / "out", "--phimvs",       folder_ / "phimvs"};
  const ProgramResult first = Script("eth3d", arguments);
  ASSERT_EQ(first.exit_code, 0) << first.output << first.errors;
  for (const char* row : {"PHI-MVS-P", "PHI-MVS-M", "PHI-MVS"}) {
    const auto result = nlohmann::json::parse(ReadBytes(folder_ / "out/tiny" / row / "row.json"));
    EXPECT_GT(result["scores"]["f1"][0].get<double>(), 99.9) << "the exact points score full marks";
    EXPECT_EQ(result["num_images"], 4);
  }
  EXPECT_THAT(ReadBytes(folder_ / "out/training.md"), HasSubstr("| tiny | "));
  EXPECT_THAT(first.output, HasSubstr("left out: botanical_garden"));
  const std::string calls = ReadBytes(folder_ / "calls");
  EXPECT_THAT(calls, HasSubstr("--preset paper --PatchMatchStereo.max_image_size 80"));  // half of 160
  EXPECT_THAT(calls, HasSubstr("--PhiInference.mode off"));
  EXPECT_THAT(calls, HasSubstr("--PhiInference.mode min_cost"));

  const ProgramResult second = Script("eth3d", arguments);
  ASSERT_EQ(second.exit_code, 0) << second.errors;
  EXPECT_EQ(ReadBytes(folder_ / "calls"), calls) << "nothing runs twice";
}

// The layout that another script makes, read by the one for ETH3D: scans in the frames of scanners, a training and a test
// scene, and the folder that the server takes.
TEST_F(ComparisonScripts, Eth3dWritesTheSubmissionOfTrainingAndTestScenes) {
  const auto stand_in = [&](const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), {"--layout", "eth3d", "--name", name, "--workspace_path", *room_ / "room/dense",
                               "--truth_depth_maps", TruthDepths(), "--output_path", folder_ / "data"});
    const ProgramResult result = Script("benchmark_standin", more);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  };
  stand_in("pipes", {"--scan_step", "1", "--num_scans", "4"});
  stand_in("statue", {"--test"});
  const ProgramResult result = Script("eth3d", {"--data_path", folder_ / "data", "--output_path",
                                                folder_ / "out", "--phimvs", folder_ / "phimvs"});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  const auto row = nlohmann::json::parse(ReadBytes(folder_ / "out/pipes/PHI-MVS/row.json"));
  EXPECT_GT(row["scores"]["f1"][0].get<double>(), 99.9);
  EXPECT_THAT(ReadBytes(folder_ / "out/training.md"),
              HasSubstr("| pipes | 100.00 | 100.00 | 100.00 | 100.00 | 74.84 | 82.36 | 91.03 | 97.17 |"));
  EXPECT_THAT(ReadBytes(folder_ / "out/test.md"), HasSubstr("| statue, PHI-MVS/P | 4 |"));
  for (const char* name : {"PHI-MVS-P", "PHI-MVS-M", "PHI-MVS"}) {
    const fs::path submission = folder_ / "out/submission" / name / "high_res_multi_view";
    std::set<std::string> files;
    for (const auto& entry : fs::directory_iterator(submission))
      files.insert(entry.path().filename().string());
    EXPECT_EQ(files, (std::set<std::string>{"pipes.ply", "pipes.txt", "statue.ply", "statue.txt"}));
    EXPECT_THAT(ReadBytes(submission / "statue.txt"), testing::MatchesRegex("runtime [0-9]+\\.[0-9]+\n"));
  }
}

TEST_F(ComparisonScripts, Eth3dRunsAllWindowsOfThePaper) {
  ASSERT_EQ(Script("benchmark_standin", {"--layout", "eth3d", "--name", "office", "--workspace_path",
                                         *room_ / "room/dense", "--truth_depth_maps", TruthDepths(),
                                         "--output_path", folder_ / "data", "--scan_step", "4"})
                .exit_code,
            0);
  const ProgramResult result =
      Script("eth3d", {"--data_path", folder_ / "data", "--output_path", folder_ / "out", "--phimvs",
                       folder_ / "phimvs", "--rows", "windows"});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  const std::string table = ReadBytes(folder_ / "out/windows.md");
  for (const char* row : {"5/5", "5/6", "6/6", "5/7", "7/7", "5/8", "8/8", "5/9", "9/9", "5/10", "10/10"})
    EXPECT_THAT(table, HasSubstr("| " + std::string(row) + " | "));
  EXPECT_THAT(table, HasSubstr("67.89 | 81.27 | 91.50 | 95.73 | - | 31.60 |"));  // the paper's 10/10
  EXPECT_THAT(ReadBytes(folder_ / "calls"),
              HasSubstr("--PatchMatchStereo.window_radius 9 --PatchMatchStereo.window_step 1.8"));
}

TEST_F(ComparisonScripts, Eth3dSaysWhatLayoutItWants) {
  fs::create_directories(folder_ / "data/empty");
  const ProgramResult result =
      Script("eth3d", {"--data_path", folder_ / "data", "--output_path", folder_ / "out"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.errors, HasSubstr("scan_alignment.mlp"));
}

// The stand-in's maps and points are exact in every row: full marks, and a table of each heading that was asked for.
TEST_F(ComparisonScripts, AblationRunsRowsOnceAndWritesTables) {
  const std::vector<std::string> arguments{"--output_path",
                                           folder_ / "out",
                                           "--phimvs",
                                           folder_ / "phimvs",
                                           "--tables",
                                           "Filling,Paper: filling",
                                           "--scene",
                                           "tiny",
                                           *room_ / "room/dense",
                                           folder_ / "exact.ply",
                                           TruthDepths(),
                                           "1"};
  const ProgramResult first = Script("ablation", arguments);
  ASSERT_EQ(first.exit_code, 0) << first.output << first.errors;
  const std::string tables = ReadBytes(folder_ / "out/tables.md");
  EXPECT_THAT(tables, HasSubstr("### Filling"));
  EXPECT_THAT(tables, HasSubstr("### Paper: filling"));
  EXPECT_THAT(tables, HasSubstr("| 62.26 | 75.73 | 87.12 | 92.70 |"));  // the paper's mean without filling
  EXPECT_THAT(tables, Not(HasSubstr("### Windows")));
  EXPECT_THAT(tables, HasSubstr("| min_cost | 100.00 | 100.00 | 100.00 | 100.00 | 100.00 | 100.00 | "));
  EXPECT_THAT(tables, HasSubstr("| PHI-MVS/M | 100.00 | 100.00 | 100.00 | "));
  const std::string calls = ReadBytes(folder_ / "calls");
  EXPECT_THAT(calls, HasSubstr("--PhiInference.mode min_cost"));
  EXPECT_THAT(calls, HasSubstr("--preset paper --PhiInference.mode off"));
  EXPECT_THAT(calls,
              HasSubstr("--output_path " + (folder_ / "out/run/fused.ply").string() + " --preset paper"))
      << "fusion, too";
  ASSERT_EQ(Script("ablation", arguments).exit_code, 0);
  EXPECT_EQ(ReadBytes(folder_ / "calls"), calls) << "nothing runs twice";
}

// COLMAP's workspace is in the room's frame, the published trajectory in another one of 3.7 times its size: only trajectory,
// matrix and crop together bring the exact points onto the truth.
TEST_F(ComparisonScripts, TanksAndTemplesAlignsCropsAndScores) {
  colmap_ext::SparseModel model = colmap_ext::ReadSparseModel(*room_ / "room/dense/sparse");
  std::map<std::string, std::string> renamed;  // as the layout names photos
  for (const colmap_ext::SparseImage& image : model.images) renamed[image.name];
  int number = 0;
  for (auto& [from, to] : renamed)
    to = "00000" + std::to_string(++number) + fs::path(from).extension().string();
  fs::create_directories(folder_ / "dense/stereo/depth_maps");
  fs::create_directories(folder_ / "dense/images");
  for (colmap_ext::SparseImage& image : model.images) {
    fs::copy_file(*room_ / "room/dense/images" / image.name, folder_ / "dense/images" / renamed[image.name]);
    image.name = renamed[image.name];
  }
  fs::create_directories(folder_ / "dense/sparse");
  colmap_ext::WriteSparseModelBinary(model, folder_ / "dense/sparse");
  WriteBytes(folder_ / "dense/stereo/patch-match.cfg", "000001.jpg\n__auto__, 20\n");
  ASSERT_EQ(
      Script("benchmark_standin",
             {"--layout", "tanks_and_temples", "--name", "Barn", "--workspace_path", *room_ / "room/dense",
              "--truth_depth_maps", TruthDepths(), "--output_path", folder_ / "data", "--scan_step", "1"})
          .exit_code,
      0);
  WriteProgram(folder_ / "colmap", "echo \"$*\" >> '" + (folder_ / "colmap_calls").string() +
                                       "'\nif [ \"$1\" = image_undistorter ]; then cp -r '" +
                                       (folder_ / "dense").string() + "' \"$7\"; fi\n");
  const std::vector<std::string> arguments{"--data_path",   folder_ / "data",  "--output_path",
                                           folder_ / "out", "--phimvs",        folder_ / "phimvs",
                                           "--colmap",      folder_ / "colmap"};
  const ProgramResult result = Script("tanks_and_temples", arguments);
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  EXPECT_THAT(ReadBytes(folder_ / "colmap_calls"), HasSubstr("mapper --database_path"));
  const auto scores = nlohmann::json::parse(ReadBytes(folder_ / "out/Barn/scene.json"))["scores"];
  EXPECT_EQ(scores["tolerance"], 0.01);  // the benchmark's for this name
  EXPECT_GT(scores["f_score"].get<double>(), 99.9);
  EXPECT_LT(scores["trajectory_error"].get<double>(), 1e-6);
  EXPECT_TRUE(fs::exists(folder_ / "out/submission/Barn.ply"));
  EXPECT_TRUE(ReadBytes(folder_ / "out/submission/Barn.log").starts_with("0 0 0\n"));

  // Half of the volume: the points outside do not count, so that the truth's number falls and the score does not.
  const auto num_truth = [&] {
    return nlohmann::json::parse(ReadBytes(folder_ / "out/Barn/scores.json"))["num_truth"].get<int>();
  };
  const int whole = num_truth();
  auto crop = nlohmann::json::parse(ReadBytes(folder_ / "data/Barn/Barn.json"));
  crop["axis_max"] = 0.5 * (crop["axis_min"].get<double>() + crop["axis_max"].get<double>());
  WriteBytes(folder_ / "data/Barn/Barn.json", crop.dump());
  fs::remove(folder_ / "out/Barn/scene.json");
  ASSERT_EQ(Script("tanks_and_temples", arguments).exit_code, 0);
  EXPECT_LT(num_truth(), 0.8 * whole);
  EXPECT_GT(
      nlohmann::json::parse(ReadBytes(folder_ / "out/Barn/scene.json"))["scores"]["f_score"].get<double>(),
      99);

  const ProgramResult printed = Script(
      "tanks_and_temples",
      {"--data_path", folder_ / "data", "--output_path", folder_ / "other", "--colmap", "", "--print_only"});
  EXPECT_THAT(printed.output, HasSubstr("colmap image_undistorter"));
  const ProgramResult without = Script("tanks_and_temples", {"--data_path", folder_ / "data", "--output_path",
                                                             folder_ / "other", "--colmap", ""});
  EXPECT_NE(without.exit_code, 0);
  EXPECT_THAT(without.errors, HasSubstr("there is no colmap here"));
}

class CompareWithColmap : public ComparisonScripts {
 protected:
  // A COLMAP whose head line is `head` and that runs as the stand-in does.
  ProgramResult Compare(const std::string& head, std::vector<std::string> more = {}) {
    // A program that is written again is another one.
    if (head != head_) {
      WriteProgram(folder_ / "colmap", "if [ \"$1\" = help ]; then echo '" + head + "'; exit 0; fi\nexec '" +
                                           (folder_ / "phimvs").string() + "' \"$@\"\n");
      head_ = head;
    }
    std::vector<std::string> arguments{"--workspace_path", *room_ / "room/dense", "--output_path",
                                       folder_ / "out",    "--truth_path",        folder_ / "exact.ply",
                                       "--phimvs",         folder_ / "phimvs",    "--colmap",
                                       folder_ / "colmap"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Script("compare_with_colmap", arguments);
  }

  // The programs' steps in order since the last call, such as "fusion of colmap by phimvs".
  std::vector<std::string> Steps() {
    std::vector<std::string> steps;
    std::istringstream calls(fs::exists(folder_ / "calls") ? ReadBytes(folder_ / "calls") : "");
    fs::remove(folder_ / "calls");
    for (std::string line; std::getline(calls, line);) {
      std::istringstream words(line);
      std::string command, option, path;
      words >> command >> option >> path;
      if (command == "stereo_fusion") words >> option >> path;
      steps.push_back(command + " " + fs::path(path).stem().string());
    }
    return steps;
  }

  // From now on `command` of the stand-in ends so.
  void EndStepsWith(const std::string& command, const std::string& code) {
    const std::string program = ReadBytes(folder_ / "phimvs");
    WriteProgram(folder_ / "phimvs", "if [ $1 = " + command + " ]; then " + code + "; fi\n" + program.substr(program.find('\n') + 1));
  }

  nlohmann::json Summary() { return nlohmann::json::parse(ReadBytes(folder_ / "out/summary.json")); }

  std::string head_;
};

constexpr const char* kColmapWithCuda = "COLMAP 3.11.1 -- with (Commit x on y with CUDA)";

TEST_F(CompareWithColmap, RunsBothAndCrossesFusers) {
  const ProgramResult result = Compare("COLMAP 3.11.1 -- with (Commit x on y with CUDA)");
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  const auto summary = Summary();
  EXPECT_EQ(summary["clouds"].size(), 4u);
  EXPECT_NEAR(summary["clouds"][0]["scores"]["f1"][0].get<double>(), 100, 1e-6);
  EXPECT_GT(summary["maps"]["colmap"]["coverage"].get<double>(), 50);
  EXPECT_GT(summary["maps"]["phimvs"]["seconds"].get<double>(), 0);
  EXPECT_TRUE(summary["notes"].empty()) << summary["notes"];
  EXPECT_EQ(summary["colmap"]["stereo"], "COLMAP 3.11.1 -- with (Commit x on y with CUDA)");
  EXPECT_THAT(ReadBytes(folder_ / "out/report.html"), HasSubstr("Difference to COLMAP"));
  EXPECT_FALSE(fs::exists(*room_ / "room/dense/stereo/phimvs.json")) << "the workspace itself is not changed";
}

// A module that answers as a pycolmap with CUDA does; its stereo and fusion are the stand-ins'.
TEST_F(CompareWithColmap, TakesPycolmapWhereNoProgramHasCuda) {
  const std::string stand_in = (folder_ / "phimvs").string();
  WriteBytes(folder_ / "modules/pycolmap.py",
             "import subprocess\n"
             "__version__, has_cuda = '4.2.1', True\n"
             "class PatchMatchOptions:\n"
             "  geom_consistency, num_iterations, filter_min_ncc = False, 5, 0.1\n"
             "def patch_match_stereo(workspace, options):\n"
             "  print('options', options.geom_consistency, options.num_iterations, options.filter_min_ncc)\n"
             "  subprocess.run(['" +
                 stand_in +
                 "', 'patch_match_stereo', '--workspace_path', workspace], check=True)\n"
                 "def stereo_fusion(cloud, workspace, output_type):\n"
                 "  assert output_type == 'PLY'\n"
                 "  subprocess.run(['" +
                 stand_in +
                 "', 'stereo_fusion', '--workspace_path', workspace, '--output_path', cloud],"
                 " check=True)\n");
  WriteProgram(folder_ / "python",
               "PYTHONPATH='" + (folder_ / "modules").string() + "' exec python3 \"$@\"\n");
  const ProgramResult result = Script(
      "compare_with_colmap",
      {"--workspace_path", *room_ / "room/dense", "--output_path", folder_ / "out", "--truth_path",
       folder_ / "exact.ply", "--phimvs", folder_ / "phimvs", "--colmap", "", "--python", folder_ / "python",
       "--colmap_options", "--PatchMatchStereo.num_iterations 3 --PatchMatchStereo.filter_min_ncc 0.2"});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  EXPECT_EQ(Summary()["colmap"]["stereo"], "pycolmap 4.2.1");
  EXPECT_EQ(Summary()["clouds"].size(), 4u);
  EXPECT_TRUE(Summary()["notes"].empty()) << Summary()["notes"];
  EXPECT_THAT(ReadBytes(folder_ / "out/colmap.log"), HasSubstr("options True 3 0.2"));

  fs::remove(folder_ / "calls");
  ASSERT_EQ(Script("compare_with_colmap",
                   {"--workspace_path", *room_ / "room/dense", "--output_path", folder_ / "out",
                    "--truth_path", folder_ / "exact.ply", "--phimvs", folder_ / "phimvs", "--colmap", "",
                    "--python", folder_ / "python", "--colmap_options",
                    "--PatchMatchStereo.num_iterations 3 --PatchMatchStereo.filter_min_ncc 0.2"})
                .exit_code,
            0);
  EXPECT_FALSE(fs::exists(folder_ / "calls") &&
               ReadBytes(folder_ / "calls").find("patch_match_stereo") != std::string::npos)
      << "whole steps are not run again";
}

TEST_F(CompareWithColmap, SaysWhatIsMissingWithoutCudaAndMaps) {
  const ProgramResult result = Compare("COLMAP 3.8 -- (Commit x on y without CUDA)");
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  EXPECT_THAT(result.output, HasSubstr("COLMAP's side of the comparison is missing"));
  EXPECT_FALSE(Summary()["maps"].contains("colmap"));
}

TEST_F(CompareWithColmap, RunsWhatAChangeReachesAndNothingElse) {
  const std::vector<std::string> of_phimvs{"patch_match_stereo phimvs",
                                           "stereo_fusion phimvs_maps_phimvs_fusion",
                                           "evaluate phimvs_maps_phimvs_fusion",
                                           "stereo_fusion phimvs_maps_colmap_fusion",
                                           "evaluate phimvs_maps_colmap_fusion",
                                           "report phimvs"};
  ASSERT_EQ(Compare(kColmapWithCuda).exit_code, 0);
  EXPECT_EQ(Steps().size(), 11u);
  ASSERT_EQ(Compare(kColmapWithCuda).exit_code, 0);
  EXPECT_THAT(Steps(), testing::IsEmpty());

  const std::string option = "--phimvs_options=--PhiInference.mode off";
  ASSERT_EQ(Compare(kColmapWithCuda, {option}).exit_code, 0);
  EXPECT_EQ(Steps(), of_phimvs);
  ASSERT_EQ(Compare(kColmapWithCuda, {option}).exit_code, 0);
  EXPECT_THAT(Steps(), testing::IsEmpty());

  WritePly(folder_ / "exact.ply", {world_.begin(), world_.begin() + 1000});
  ASSERT_EQ(Compare(kColmapWithCuda, {option}).exit_code, 0);
  EXPECT_EQ(Steps(), (std::vector<std::string>{"evaluate colmap_maps_phimvs_fusion", "evaluate colmap_maps_colmap_fusion",
                                               "evaluate phimvs_maps_phimvs_fusion", "evaluate phimvs_maps_colmap_fusion",
                                               "report phimvs"}))
      << "another truth";
  EXPECT_LT(Summary()["clouds"][2]["scores"]["accuracy"][0].get<double>(), 50);

  fs::remove(folder_ / "out/phimvs_maps_colmap_fusion.ply");
  ASSERT_EQ(Compare(kColmapWithCuda, {option}).exit_code, 0);
  EXPECT_EQ(Steps(), (std::vector<std::string>{"stereo_fusion phimvs_maps_colmap_fusion", "evaluate phimvs_maps_colmap_fusion",
                                               "report phimvs"}));

  EndStepsWith("nothing", "exit 1");
  ASSERT_EQ(Compare(kColmapWithCuda, {option}).exit_code, 0);
  const std::vector<std::string> steps = Steps();
  EXPECT_EQ(steps.size(), 9u) << "another phimvs: all but COLMAP's stereo and COLMAP's fusion of its maps";
  EXPECT_THAT(steps, Not(testing::Contains("patch_match_stereo colmap")));
}

// COLMAP goes on where its maps are, whatever they were made with.
TEST_F(CompareWithColmap, RemovesColmapsMapsOfOtherOptions) {
  const fs::path old = folder_ / "out/colmap/stereo/depth_maps/old.geometric.bin";
  ASSERT_EQ(Compare(kColmapWithCuda).exit_code, 0);
  const fs::path record = folder_ / "out/colmap.step.json";
  auto stopped = nlohmann::json::parse(ReadBytes(record));
  stopped["exit_code"] = nullptr;
  WriteBytes(record, stopped.dump());
  fs::copy_file(*fs::directory_iterator(old.parent_path()), old);
  ASSERT_EQ(Compare(kColmapWithCuda).exit_code, 0);
  EXPECT_TRUE(fs::exists(old)) << "a run that was stopped goes on";
  ASSERT_EQ(Compare(kColmapWithCuda, {"--colmap_options=--PatchMatchStereo.num_iterations 3"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(old));
  EXPECT_TRUE(fs::exists(*room_ / "room/dense/images"));
}

TEST_F(CompareWithColmap, SaysWhatToGiveWhereThereIsNoPhimvs) {
  const fs::path program = folder_ / "none/phimvs";
  const ProgramResult result = Script(
      "compare_with_colmap", {"--workspace_path", *room_ / "room/dense", "--output_path", folder_ / "out", "--phimvs", program});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.errors.starts_with("there is no program " + program.string() + ": give --phimvs PROGRAM")) << result.errors;
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(CompareWithColmap, WarnsOfVersionsThatShearUnequalWidths) {
  EXPECT_THAT(Compare("COLMAP 4.1.1 -- (with CUDA)").output, Not(HasSubstr("shears")))
      << "all widths are equal here";
  // The same room with one camera more, of another width.
  fs::copy(*room_ / "room/dense", folder_ / "unequal", fs::copy_options::recursive);
  colmap_ext::SparseModel model = colmap_ext::ReadSparseModel(folder_ / "unequal/sparse");
  colmap_ext::SparseCamera other = model.cameras.begin()->second;
  other.camera_id = 99;
  other.width += 8;
  model.cameras[99] = other;
  colmap_ext::WriteSparseModelBinary(model, folder_ / "unequal/sparse");
  const std::vector<std::string> unequal{"--workspace_path", folder_ / "unequal", "--output_path", folder_ / "other"};
  EXPECT_THAT(Compare("COLMAP 4.1.1 -- (with CUDA)", unequal).output, HasSubstr("shears"));
  EXPECT_THAT(Compare("COLMAP 4.2.0 -- (with CUDA)", unequal).output, Not(HasSubstr("shears")));
}

TEST_F(CompareWithColmap, LeavesFoldersThatItDidNotMake) {
  // A project whose workspace has the name of a copy; another workspace's comparison.
  fs::create_directories(folder_ / "project");
  fs::copy(*room_ / "room/dense", folder_ / "project/colmap", fs::copy_options::recursive);
  const ProgramResult own = Compare(kColmapWithCuda, {"--output_path", folder_ / "project"});
  EXPECT_EQ(own.exit_code, 1);
  EXPECT_THAT(own.errors, HasSubstr("project/colmap is there, and was not made by a comparison"));
  ASSERT_EQ(Compare(kColmapWithCuda).exit_code, 0);
  EXPECT_THAT(Compare(kColmapWithCuda, {"--workspace_path", folder_ / "project/colmap"}).errors, HasSubstr("name another --output_path"));
  EXPECT_THAT(Compare(kColmapWithCuda, {"--colmap_maps", folder_ / "out/colmap"}).errors, HasSubstr("copy it elsewhere"));
  EXPECT_FALSE(fs::is_empty(folder_ / "out/colmap/stereo/depth_maps"));
}

TEST_F(CompareWithColmap, AsksForWhatIsMissingBeforeItBegins) {
  for (const char* option : {"--truth_path", "--truth_depth_maps", "--colmap_maps"}) {
    const ProgramResult result = Compare(kColmapWithCuda, {option, folder_ / "none.ply"});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.errors, option + (": there is no " + (folder_ / "none.ply").string()) + "\n");
    EXPECT_FALSE(fs::exists(folder_ / "out"));
  }
}

TEST_F(CompareWithColmap, EndsWithOneWhereAStepOfPhimvsFailed) {
  EndStepsWith("evaluate", "exit 2");
  const ProgramResult scores = Compare(kColmapWithCuda);
  EXPECT_EQ(scores.exit_code, 1);
  EXPECT_THAT(scores.output, HasSubstr("phimvs evaluate of phimvs_maps_colmap_fusion.ply failed: see "));
  EXPECT_EQ(Summary()["clouds"].size(), 4u);
  EXPECT_TRUE(fs::exists(folder_ / "out/report.html"));

  EndStepsWith("stereo_fusion", "exit 2");
  const ProgramResult fusion = Compare("COLMAP 3.8 -- (Commit x on y without CUDA)", {"--colmap", ""});
  EXPECT_EQ(fusion.exit_code, 1);
  EXPECT_THAT(fusion.output, HasSubstr("phimvs stereo_fusion of phimvs's maps failed: see "));
  EXPECT_THAT(ReadBytes(folder_ / "out/report.step.json"), Not(HasSubstr("--cloud_path"))) << "an earlier run's";
}

TEST_F(CompareWithColmap, TellsOfCloudsWithoutSomeImages) {
  EndStepsWith("stereo_fusion", "cp '" + (folder_ / "exact.ply").string() + "' \"$5\"; exit 4");
  const ProgramResult result = Compare("", {"--colmap", ""});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("phimvs stereo_fusion of phimvs's maps is without some images: see "));
  EXPECT_FALSE(Summary()["clouds"][0]["scores"].is_null());
}

// A comma parts the names of --evaluation_path; Python writes in the encoding of the terminal.
TEST_F(CompareWithColmap, TakesAnyFolderAndWordsInQuotes) {
  const fs::path out = folder_ / "Küche, neu";
  const ProgramResult result = RunProgram(
      {"python3", PHIMVS_SOURCE_DIR "/scripts/compare_with_colmap", "--workspace_path", *room_ / "room/dense", "--output_path", out,
       "--truth_path", folder_ / "exact.ply", "--phimvs", folder_ / "phimvs", "--colmap", "", "--phimvs_options",
       "--PhiStereo.mask_path 'my masks'", "--truth_depth_maps", TruthDepths()},
      {"LC_ALL=C", "PYTHONUTF8=0", "PYTHONCOERCECLOCALE=0"});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  EXPECT_THAT(ReadBytes(out / "summary.md"), HasSubstr("| phimvs | phimvs | "));
  EXPECT_THAT(ReadBytes(out / "report.html"), HasSubstr("phimvs_maps_phimvs_fusion"));
  EXPECT_EQ(nlohmann::json::parse(ReadBytes(out / "phimvs.step.json"))["command"].back(), "my masks");
}

}  // namespace

// scripts/thin_workspace on four cameras before a wall, and the bench's way from rendered scenes to tables: assemble, pack,
// unpack, benchmark. Stereo and fusion are stand-ins there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/sparse_model.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using colmap_ext::SparseModel;
using phi::Array2D;
using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

namespace fs = std::filesystem;

constexpr int kWidth = 40, kHeight = 30;

ProgramResult Script(const std::string& name, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"python3", PHIMVS_SOURCE_DIR "/scripts/" + name});
  return RunProgram(arguments, {"PYTHONDONTWRITEBYTECODE=1"});
}

void WriteCloud(const fs::path& path, const std::vector<Eigen::Vector3f>& points, std::uint8_t views) {
  std::string body;
  for (const Eigen::Vector3f& p : points) {
    body.append(reinterpret_cast<const char*>(p.data()), 12);
    body += static_cast<char>(views);
  }
  WriteBytes(
      path, "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.size()) +
                "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar views\nend_header\n" +
                body);
}

struct Cloud {
  std::vector<Eigen::Vector3d> points;
  std::vector<int> views;
};

Cloud ReadCloud(const fs::path& path) {
  Cloud cloud;
  colmap_ext::PlyRows(path).ForEachRow("vertex", {"x", "y", "z", "views"}, [&](const double* v) {
    cloud.points.emplace_back(v[0], v[1], v[2]);
    cloud.views.push_back(static_cast<int>(v[3]));
  });
  return cloud;
}

// Cameras a unit apart along x look at a wall 2 units away: a point (X, 0.04, 2) is at column 10 (X - i) + 20 of image i.
class ThinWorkspace : public testing::Test {
 protected:
  void SetUp() override {
    if (RunProgram({"python3", "-c", "import numpy"}).exit_code != 0) GTEST_SKIP() << "no python3 with numpy";
    model_.cameras[7] = {7, 1, kWidth, kHeight, {20, 20, 20, 15}};
    for (int i = 0; i < 4; ++i) {
      colmap_ext::SparseImage image;
      image.image_id = 4 - i;  // the order of names, not of numbers, counts
      image.camera_id = 7;
      image.name = std::to_string(i) + ".png";
      image.translation = Eigen::Vector3d(-i, 0, 0);
      image.observations = {{1, 2, 100}, {3, 4, 200}, {5, 6, 300}, {7, 8, 400}};
      model_.images.push_back(image);
      Array2D<float> depth(kWidth, kHeight, 2.0f);
      // The first image sees nothing from column 30 on.
      for (int y = 0; i == 0 && y < kHeight; ++y) std::fill(&depth(30, y), &depth(30, y) + 10, 0.0f);
      colmap_ext::WriteDepthMap(folder_ / "truth" / (image.name + ".bin"), depth);
      WriteBytes(dense_ / "images" / image.name, "pixels of " + image.name);
    }
    AddPoint(100, {{4, 0}, {3, 0}, {2, 0}, {1, 0}});  // all
    AddPoint(200, {{4, 1}, {3, 1}});                  // images 0 and 1
    AddPoint(300, {{4, 2}, {4, 3}, {3, 2}});          // image 0 twice, and 1
    AddPoint(400, {{2, 3}, {4, 3}});                  // images 2 and 0
    fs::create_directories(dense_ / "sparse");
    WriteBytes(dense_ / "stereo/patch-match.cfg",
               "0.png\n1.png, 2.png\n1.png\n__auto__, 20\n2.png\n1.png, 3.png\n3.png\n__all__\n");
    WriteBytes(dense_ / "stereo/fusion.cfg", "3.png\n2.png\n1.png\n0.png\n");
  }

  void AddPoint(std::uint64_t id, const std::vector<colmap_ext::TrackElement>& track) {
    colmap_ext::SparsePoint point;
    point.point3D_id = id;
    point.xyz = Eigen::Vector3d(0.25, 0.5, 2);
    point.error = 0.5;
    point.track = track;
    model_.points.push_back(point);
  }

  ProgramResult Thin(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--workspace_path", dense_, "--output_path", folder_ / "thin"});
    return Script("thin_workspace", arguments);
  }

  // The set `wall` in disturbed_, made of a set that holds the model.
  SparseModel Disturbed(const std::string& kind) {
    const fs::path set = folder_ / "data/wall";
    fs::create_directories(set);
    WriteSparseModelBinary(model_, dense_ / "sparse");
    fs::copy(dense_, set / "dense", fs::copy_options::recursive);
    WriteCloud(set / "truth.ply", {{0, 0, 2}}, 4);
    const ProgramResult result = Script("scenes/disturb", {folder_ / "data", folder_ / "disturbed", "--by", kind});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result.exit_code == 0 ? colmap_ext::ReadSparseModel(disturbed_ / "dense/sparse") : SparseModel();
  }

  void ExpectImages0And2() {
    const SparseModel thin = colmap_ext::ReadSparseModel(folder_ / "thin/dense/sparse");
    ASSERT_EQ(thin.images.size(), 2u);
    EXPECT_EQ(thin.cameras.at(7).params, model_.cameras[7].params);
    EXPECT_EQ(thin.images[0].name, "0.png");
    EXPECT_EQ(thin.images[1].name, "2.png");
    EXPECT_EQ(thin.images[1].translation, Eigen::Vector3d(-2, 0, 0));
    ASSERT_EQ(thin.points.size(), 2u) << "points 200 and 300 are seen by one image now";
    EXPECT_EQ(thin.points[0].point3D_id, 100u);
    EXPECT_EQ(thin.points[0].track.size(), 2u);
    EXPECT_EQ(thin.points[0].xyz, Eigen::Vector3d(0.25, 0.5, 2));
    EXPECT_EQ(thin.points[1].point3D_id, 400u);
    EXPECT_EQ(thin.points[1].track[1].image_id, 4u);
    // Image 0 keeps its first feature and the fourth, which becomes the second.
    ASSERT_EQ(thin.images[0].observations.size(), 2u);
    EXPECT_EQ(thin.images[0].observations[1].x, 7);
    EXPECT_EQ(thin.images[0].observations[1].point3D_id, 400u);
    EXPECT_EQ(thin.points[1].track[1].observation_index, 1u);
    EXPECT_EQ(ReadBytes(folder_ / "thin/dense/images/2.png"), "pixels of 2.png");
    EXPECT_FALSE(fs::exists(folder_ / "thin/dense/images/1.png"));
  }

  SparseModel model_;
  TemporaryFolder folder_;
  fs::path dense_ = folder_ / "dense", disturbed_ = folder_ / "disturbed/wall";
};

// Cameras turn about their centres by half a pixel or so; nothing else changes.
TEST_F(ThinWorkspace, DisturbedCamerasTurnByPixels) {
  const SparseModel model = Disturbed("poses");
  ASSERT_EQ(model.images.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const colmap_ext::SparseImage& image = model.images[i];
    EXPECT_EQ(image.name, model_.images[i].name);
    EXPECT_EQ(image.observations.size(), 4u);
    EXPECT_NEAR(image.rotation.norm(), 1, 1e-12);
    // The centre i of camera i is where it was: R (i, 0, 0) + t = 0.
    const Eigen::Vector3d moved = image.rotation * Eigen::Vector3d(static_cast<double>(i), 0, 0) + image.translation;
    EXPECT_LT(moved.norm(), 1e-12) << i;
    // What lies straight ahead moves by the focal length, 20 pixels, times the angle.
    const Eigen::Vector3d ahead = image.rotation * Eigen::Vector3d(0, 0, 1);
    const double pixels = 20 * ahead.head<2>().norm() / ahead.z();
    EXPECT_GT(pixels, 0.01) << i;
    EXPECT_LT(pixels, 2.5) << i;
  }
  EXPECT_EQ(ReadBytes(disturbed_ / "dense/sparse/points3D.bin"), ReadBytes(dense_ / "sparse/points3D.bin"));
  EXPECT_EQ(ReadBytes(disturbed_ / "dense/images/2.png"), "pixels of 2.png");
  EXPECT_EQ(ReadBytes(disturbed_ / "truth.ply"), ReadBytes(folder_ / "data/wall/truth.ply"));
  EXPECT_THAT(Script("scenes/disturb", {folder_ / "data", folder_ / "x", "--by", "fog"}).errors, HasSubstr("not 'fog'"));
}

// Centres move as well, and points go where their observations meet then.
TEST_F(ThinWorkspace, GivenPosesMoveAndPointsFollow) {
  const SparseModel model = Disturbed("given_poses");
  ASSERT_EQ(model.images.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const colmap_ext::SparseImage& image = model.images[i];
    const double moved = (image.rotation * Eigen::Vector3d(static_cast<double>(i), 0, 0) + image.translation).norm();
    EXPECT_GT(moved, 1e-6) << i;
    EXPECT_LT(moved, 0.5) << i;
  }
  ASSERT_EQ(model.points.size(), model_.points.size());
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    EXPECT_EQ(model.points[i].track.size(), model_.points[i].track.size());
    EXPECT_TRUE(model.points[i].xyz.allFinite());
  }
  EXPECT_NE(model.points[0].xyz, model_.points[0].xyz);
}

TEST_F(ThinWorkspace, KeepsEveryOtherImageAndWhatTwoOfThemSee) {
  WriteSparseModelBinary(model_, dense_ / "sparse");
  WriteBytes(dense_ / "sparse/rigs.bin", "of COLMAP 4");
  WriteBytes(dense_ / "sparse/frames.bin", "of COLMAP 4");
  const ProgramResult result = Thin({"--every", "2"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  ExpectImages0And2();
  EXPECT_EQ(ReadBytes(folder_ / "thin/dense/stereo/patch-match.cfg"), "0.png\n2.png\n2.png\n__auto__, 20\n");
  EXPECT_EQ(ReadBytes(folder_ / "thin/dense/stereo/fusion.cfg"), "2.png\n0.png\n");
  EXPECT_FALSE(fs::exists(folder_ / "thin/dense/sparse/frames.bin"))
      << "they would name images that are gone";
  if (test_support::HasProgram("colmap")) {
    const ProgramResult colmap =
        RunProgram({"colmap", "model_analyzer", "--path", folder_ / "thin/dense/sparse"});
    EXPECT_THAT(colmap.output + colmap.errors, HasSubstr("Points: 2"));
  }
}

TEST_F(ThinWorkspace, ReadsTextAndLists) {
  WriteSparseModelText(model_, dense_ / "sparse");
  EXPECT_THAT(Thin({"--images", "0,4"}).errors, HasSubstr("images 0 to 3"));
  const ProgramResult result = Thin({"--images", "2,0", "--copy_images"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  ExpectImages0And2();
  EXPECT_FALSE(fs::is_symlink(folder_ / "thin/dense/images/0.png"));
}

TEST_F(ThinWorkspace, RefusesStepsThatNoImageIsAt) {
  WriteSparseModelBinary(model_, dense_ / "sparse");
  for (const char* step : {"0", "-2"}) EXPECT_EQ(Thin({"--every", step}).errors, "thin_workspace: --every must be 1 or more\n");
}

// The folder above the workspace as the output, so that the workspace itself is what would be made; a link to it; a folder in it.
TEST_F(ThinWorkspace, LeavesWhatIsThere) {
  WriteSparseModelBinary(model_, dense_ / "sparse");
  fs::create_directory_symlink(folder_.path(), folder_ / "link");
  for (const fs::path& output : {folder_.path(), folder_ / "link", folder_ / "link/dense/thin"}) {
    const ProgramResult result = Script("thin_workspace", {"--workspace_path", dense_, "--output_path", output, "--every", "2"});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.errors, HasSubstr("name another folder")) << output;
    EXPECT_FALSE(fs::exists(dense_ / "thin"));
    ASSERT_TRUE(fs::exists(dense_ / "images/1.png")) << output;
  }
  WriteBytes(folder_ / "thin/dense/notes", "mine");
  EXPECT_THAT(Thin({"--every", "2"}).errors, HasSubstr("thin/dense exists; name another folder"));
  EXPECT_EQ(ReadBytes(folder_ / "thin/dense/notes"), "mine");

  WriteCloud(folder_ / "other/truth.ply", {{0.5f, 0.04f, 2}}, 9);
  const ProgramResult truth =
      Script("thin_workspace", {"--workspace_path", dense_, "--output_path", folder_ / "other", "--every", "2", "--truth_path",
                                folder_ / "other/truth.ply", "--truth_depth_maps", folder_ / "truth"});
  EXPECT_THAT(truth.errors, HasSubstr("truth.ply exists; name another folder"));
  EXPECT_THAT(ReadCloud(folder_ / "other/truth.ply").views, ElementsAre(9));
}

TEST_F(ThinWorkspace, CountsTheImagesLeftThatSeeATruePoint) {
  WriteSparseModelBinary(model_, dense_ / "sparse");
  WriteCloud(folder_ / "truth.ply",
             {{0.5f, 0.04f, 2},       // columns 25 and 5
              {0.96f, 0.04f, 2},      // 29.6: the last column with depth in image 0
              {1.03f, 0.04f, 2},      // 30.3: no depth there
              {0.03f, 0.04f, 2},      // 0.3 in image 2
              {-0.04f, 0.04f, 2},     // -0.4: outside image 2
              {0.5f, 0.04f, 3},       // behind the wall
              {0.5f, 0.04f, 2.015f},  // 0.7 % behind
              {0.5f, 0.04f, 2.03f}},  // 1.5 % behind
             9);
  const ProgramResult result =
      Thin({"--every", "2", "--truth_path", folder_ / "truth.ply", "--truth_depth_maps", folder_ / "truth"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Cloud cloud = ReadCloud(folder_ / "thin/truth.ply");
  EXPECT_THAT(cloud.views, ElementsAre(2, 2, 1, 2, 1, 0, 2, 0));
  EXPECT_NEAR(cloud.points[1].x(), 0.96, 1e-6);
}

// 257 images see the point: more than the property holds.
TEST_F(ThinWorkspace, ManyViewsCountAsTheMost) {
  for (int i = 0; i < 254; ++i) {
    colmap_ext::SparseImage image = model_.images[0];
    image.image_id = 5 + i;
    image.name = "more" + std::to_string(i) + ".png";
    image.observations.clear();
    model_.images.push_back(image);
    colmap_ext::WriteDepthMap(folder_ / "truth" / (image.name + ".bin"), Array2D<float>(kWidth, kHeight, 2.0f));
    WriteBytes(dense_ / "images" / image.name, "pixels");
  }
  WriteSparseModelBinary(model_, dense_ / "sparse");
  WriteCloud(folder_ / "truth.ply", {{0.5f, 0.04f, 2}}, 9);
  const ProgramResult result =
      Thin({"--every", "1", "--truth_path", folder_ / "truth.ply", "--truth_depth_maps", folder_ / "truth"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("1 of 1 true points seen by two or more"));
  EXPECT_THAT(ReadCloud(folder_ / "thin/truth.ply").views, ElementsAre(255));
}

// One scene of the judging half and its variant with every second of four images.
class Benchmark : public testing::Test {
 protected:
  void SetUp() override {
    if (RunProgram({"python3", "-c", "import numpy"}).exit_code != 0) GTEST_SKIP() << "no python3 with numpy";
    const fs::path scene = folder_ / "rendered/tiny";
    ASSERT_EQ(RunProgram({PHIMVS_BINARY, "make_scene", "--output_path", scene, "--width", "160", "--height",
                          "120", "--num_views", "4"})
                  .exit_code,
              0);
    std::vector<fs::path> maps;
    for (const auto& entry : fs::directory_iterator(scene / "truth/depth_maps")) maps.push_back(entry.path());
    for (const fs::path& map : maps) {
      std::string name = map.filename();
      if (const auto at = name.find(".geometric"); at != std::string::npos) {
        fs::rename(map, map.parent_path() / name.erase(at, 10));
      }
    }
    // What the second camera sees, so that three others may see it too.
    const SparseModel model = colmap_ext::ReadSparseModel(scene / "dense/sparse");
    const colmap_ext::SparseImage& image = model.images[1];
    const std::vector<double>& k = model.cameras.at(image.camera_id).params;
    const auto depth = colmap_ext::ReadDepthMap(scene / "truth/depth_maps" / (image.name + ".bin"));
    std::vector<Eigen::Vector3f> points, shifted;
    for (int y = 0; y < depth.height(); ++y) {
      for (int x = 0; x < depth.width(); ++x) {
        const double z = depth(x, y);
        if (!(z > 0)) continue;
        const Eigen::Vector3d in_camera((x + 0.5 - k[2]) / k[0] * z, (y + 0.5 - k[3]) / k[1] * z, z);
        points.push_back((image.rotation.conjugate() * (in_camera - image.translation)).cast<float>());
        shifted.push_back(points.back() + Eigen::Vector3f(0, 0, 50));
      }
    }
    WriteCloud(scene / "truth.ply", points, 0);
    WriteCloud(folder_ / "wrong.ply", shifted, 0);
    WriteBytes(
        folder_ / "split.json",
        R"({"scenes": [{"name": "tiny", "half": "judge", "tolerances": [0.02, 0.05], "voxel_size": 0.01,)"
        R"( "variants": [{"every": 2}]}, {"name": "absent", "half": "judge", "variants": []}]})");
    // The true points for a cloud, and wrong ones where fusion is told to ask for nine pixels.
    WriteBytes(folder_ / "phimvs", "#!/bin/sh\necho \"$*\" >> '" + (folder_ / "calls").string() +
                                       "'\ncase \"$*\" in\npatch_match_stereo*) ;;\n"
                                       "stereo_fusion*min_num_pixels\\ 9*) cp '" +
                                       (folder_ / "wrong.ply").string() +
                                       "' \"$5\" ;;\nstereo_fusion*) cp '" + (scene / "truth.ply").string() +
                                       "' \"$5\" ;;\n*) exec '" PHIMVS_BINARY "' \"$@\" ;;\nesac\n");
    fs::permissions(folder_ / "phimvs", fs::perms::owner_all);
  }

  // Lays out the sets, packs them and unpacks them to data/.
  void MakeData() {
    const std::vector<std::string> split{"--split", folder_ / "split.json"};
    const auto with = [&](std::vector<std::string> words) {
      words.insert(words.end(), split.begin(), split.end());
      return words;
    };
    const ProgramResult assembled = Script(
        "scenes/assemble",
        with({"--public", folder_ / "none", "--rendered", folder_ / "rendered", "--data", folder_ / "sets"}));
    ASSERT_EQ(assembled.exit_code, 0) << assembled.errors;
    EXPECT_THAT(assembled.output, HasSubstr("absent: left out"));
    const ProgramResult packed = Script("scenes/pack", with({folder_ / "sets", folder_ / "bench.tar.xz"}));
    ASSERT_EQ(packed.exit_code, 0) << packed.errors;
    const ProgramResult unpacked =
        Script("scenes/pack", with({"--unpack", folder_ / "bench.tar.xz", folder_ / "data"}));
    ASSERT_EQ(unpacked.exit_code, 0) << unpacked.errors;
  }

  ProgramResult Run(std::vector<std::string> more) {
    more.insert(more.begin(), {"--phimvs", folder_ / "phimvs", "--data", folder_ / "data", "--split",
                               folder_ / "split.json", "--half", "judge", "--commit", "abc1234"});
    return Script("benchmark", more);
  }

  std::size_t Calls(const std::string& command) const {
    const std::string calls = ReadBytes(folder_ / "calls");
    std::size_t count = 0;
    for (std::size_t at = calls.find(command); at != std::string::npos; at = calls.find(command, at + 1))
      ++count;
    return count;
  }

  TemporaryFolder folder_;
};

// Another archive may be unpacked into the same folder meanwhile.
TEST_F(Benchmark, UnpackingLeavesWhatIsOfNoSetOfTheArchive) {
  WriteBytes(folder_ / "data/absent/truth.code", "half");
  MakeData();
  EXPECT_EQ(ReadBytes(folder_ / "data/absent/truth.code"), "half");
  EXPECT_TRUE(fs::exists(folder_ / "data/tiny/truth.ply"));
}

TEST_F(Benchmark, PackedCloudsAreTheSameWithinASixthOfAVoxel) {
  MakeData();
  for (const std::string set : {"tiny", "tiny_every2"}) {
    const Cloud before = ReadCloud(folder_ / "sets" / set / "truth.ply");
    const Cloud after = ReadCloud(folder_ / "data" / set / "truth.ply");
    ASSERT_EQ(before.points.size(), after.points.size());
    // Packed in another order: each point's nearest partner, for a share of them.
    for (std::size_t i = 0; i < before.points.size(); i += 997) {
      double nearest = 1e9;
      int views = -1;
      for (std::size_t k = 0; k < after.points.size(); ++k) {
        const double distance = (before.points[i] - after.points[k]).cwiseAbs().maxCoeff();
        if (distance < nearest) nearest = distance, views = after.views[k];
      }
      EXPECT_LE(nearest, 0.00168);
      EXPECT_EQ(views, before.views[i]);
    }
  }
  EXPECT_TRUE(
      fs::is_symlink(folder_ / "data/tiny_every2/dense/images/" /
                     fs::directory_iterator(folder_ / "data/tiny_every2/dense/images")->path().filename()));
}

TEST_F(Benchmark, RunsStereoOnceForAllFusionsComparesAndLogs) {
  MakeData();
  const std::vector<std::string> words{"--seeds",          "0,1",
                                       "--fusion_options", "",
                                       "--fusion_options", "--StereoFusion.min_num_pixels 9",
                                       "--output",         folder_ / "a.json"};
  const ProgramResult first = Run(words);
  ASSERT_EQ(first.exit_code, 0) << first.output << first.errors;
  EXPECT_EQ(Calls("patch_match_stereo"), 4u) << "two sets, two seeds";
  EXPECT_EQ(Calls("stereo_fusion"), 8u);
  EXPECT_THAT(first.output, HasSubstr("left out: absent"));
  const auto rows = nlohmann::json::parse(ReadBytes(folder_ / "a.json"))["rows"];
  EXPECT_GT(rows[""]["tiny"]["0"]["completeness"][0].get<double>(), 99.9);
  EXPECT_GT(rows[""]["tiny_every2"]["1"]["completeness"][0].get<double>(), 99.9);
  EXPECT_GT(rows[""]["tiny_every2"]["1"]["f1"][0].get<double>(), 99.9) << "right where one image sees, too";
  EXPECT_LT(rows[""]["tiny_every2"]["1"]["accuracy_of_seen"][0].get<double>(), 99);
  EXPECT_EQ(rows["--StereoFusion.min_num_pixels 9"]["tiny"]["0"]["f1"][1], 0.0);
  EXPECT_THAT(first.output, HasSubstr("| tiny_every2 | 0.0 | 0.0 | 0.0 |"));

  std::vector<std::string> logged = words;
  logged.insert(logged.end(), {"--log", folder_ / "log.jsonl", "--note", "a trial"});
  ASSERT_EQ(Run(logged).exit_code, 0);
  EXPECT_EQ(Calls("patch_match_stereo"), 4u) << "nothing runs twice";
  const std::string log = ReadBytes(folder_ / "log.jsonl");
  const auto entry = nlohmann::json::parse(log.substr(0, log.find('\n')));
  EXPECT_EQ(entry["commit"], "abc1234");
  EXPECT_EQ(entry["note"], "a trial");
  EXPECT_GT(entry["mean"]["C"].get<double>(), 99.9);
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 2) << "a line for each fusion";

  EXPECT_THAT(Run({"--options", "--PhiInference.mode off", "--output", folder_ / "a.json"}).errors,
              HasSubstr("name another file"));
  ASSERT_EQ(Run({"--seeds", "0", "--fusion_options", "--StereoFusion.min_num_pixels 9", "--output",
                 folder_ / "b.json"})
                .exit_code,
            0);
  const ProgramResult compared = Script("benchmark", {"--compare", folder_ / "b.json", folder_ / "a.json"});
  ASSERT_EQ(compared.exit_code, 0) << compared.errors;
  EXPECT_THAT(compared.output, HasSubstr("| tiny | +0.0 | +0.0 | +0.0 |")) << "the same fusion is compared";
}

TEST_F(Benchmark, AblationRunsEachRuleOffAndScaledAndGoesOn) {
  MakeData();
  const std::vector<std::string> words{"--rules",  "--phimvs",       folder_ / "phimvs",
                                       "--data",   folder_ / "data", "--split",
                                       folder_ / "split.json",       "--seeds",
                                       "0,1",      "--only",         "own_texture,cloud_holes,region_normals",
                                       "--lanes",  "2",              "--settings",
                                       "off,0.7",  "--output_path",  folder_ / "rules"};
  std::vector<std::string> no_time = words;
  no_time.insert(no_time.end(), {"--time_limit", "0.001"});
  const ProgramResult stopped = Script("ablation", no_time);
  EXPECT_EQ(stopped.exit_code, 0) << stopped.errors;
  EXPECT_THAT(stopped.output, HasSubstr("the time was up"));
  EXPECT_EQ(Calls("patch_match_stereo"), 0u);

  const ProgramResult run = Script("ablation", words);
  ASSERT_EQ(run.exit_code, 0) << run.output << run.errors;
  // Two sets, two seeds: the maps as they are, own_texture off and scaled, region_normals off; the rule of fusion has maps already.
  EXPECT_EQ(Calls("patch_match_stereo"), 16u);
  EXPECT_EQ(Calls("--PhiStereo.rules own_texture=0.7"), 4u);
  EXPECT_EQ(Calls("--PhiStereo.rules region_normals=0.7"), 0u) << "has no constants";
  EXPECT_EQ(Calls("stereo_fusion"), 24u);
  EXPECT_EQ(Calls("--PhiFusion.rules cloud_holes=0"), 8u) << "off and 0.7";
  const auto rows = nlohmann::json::parse(ReadBytes(folder_ / "rules/rules.json"))["rows"];
  ASSERT_EQ(rows.size(), 5u);
  EXPECT_EQ(rows[0]["rule"], "own_texture");
  EXPECT_EQ(rows[0]["half"], "judge");
  EXPECT_EQ(rows[0]["sets"], 2);
  EXPECT_EQ(rows[0]["seeds"], 2);
  EXPECT_EQ(rows[0]["f1"][0], 0.0) << "the stand-in knows no rules";
  EXPECT_THAT(ReadBytes(folder_ / "rules/rules.md"), HasSubstr("| cloud_holes | 0.7 | judge | +0.00 | +0.00 | tiny"));

  ASSERT_EQ(Script("ablation", words).exit_code, 0);
  EXPECT_EQ(Calls("stereo_fusion"), 24u) << "nothing runs twice";

  // A set that lacks a seed counts as a whole one: the number of runs tells.
  auto results = nlohmann::json::parse(ReadBytes(folder_ / "rules/results.json"));
  results["rows"]["judge"]["own_texture=0"]["tiny"].erase("1");
  std::ofstream(folder_ / "rules/results.json") << results;
  ASSERT_EQ(Script("ablation", no_time).exit_code, 0);
  const auto partly = nlohmann::json::parse(ReadBytes(folder_ / "rules/rules.json"))["rows"];
  EXPECT_EQ(partly[0]["sets"], 2);
  EXPECT_EQ(partly[0]["seeds"], 2);
  EXPECT_EQ(partly[0]["runs"], 3);
  EXPECT_EQ(partly[1]["runs"], 4);
}

}  // namespace

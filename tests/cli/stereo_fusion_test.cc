// The command as its user meets it, and COLMAP's programs on its output.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/sparse_model.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/map_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::HasProgram;
using test_support::ProgramResult;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using ::testing::HasSubstr;

// Content by name.
std::map<std::string, std::string> FilesIn(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& file : fs::directory_iterator(folder)) files[file.path().filename()] = test_support::ReadBytes(file.path());
  return files;
}

class StereoFusionCommand : public ::testing::Test {
 protected:
  void SetUp() override { test_support::WriteMapWorkspace(test_support::SphereScene(), folder_.path()); }

  ProgramResult Fuse(std::vector<std::string> arguments, const std::string& output = "fused.ply") const {
    std::vector<std::string> command = {PHIMVS_BINARY,      "stereo_fusion",
                                        "--workspace_path", folder_.path().string(),
                                        "--output_path",    (folder_ / output).string()};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return RunProgram(command);
  }

  TemporaryFolder folder_;
};

// It is written, as COLMAP does; but the earlier one is lost.
TEST_F(StereoFusionCommand, AnEmptyCloudOverAnEarlierOneIsToldOf) {
  for (const auto& [type, name] : {std::pair("PLY", "fused.ply"), std::pair("BIN", "model")}) {
    const std::vector<std::string> too_strict = {"--output_type", type, "--StereoFusion.min_num_pixels", "90"};
    const auto says_so = HasSubstr((folder_ / name).string() + ": this cloud has no point, and has replaced the earlier one");
    const ProgramResult first = Fuse(too_strict, name);
    EXPECT_EQ(first.exit_code, 0) << first.errors;
    EXPECT_THAT(first.errors, testing::Not(says_so)) << "there was none";
    EXPECT_THAT(Fuse({"--output_type", type}, name).errors, testing::Not(says_so));
    EXPECT_THAT(Fuse(too_strict, name).errors, says_so);
  }
}

TEST_F(StereoFusionCommand, TakesColmapsOptions) {
  const ProgramResult result = Fuse({"--workspace_format",
                                     "COLMAP",
                                     "--pmvs_option_name",
                                     "option-all",
                                     "--input_type",
                                     "geometric",
                                     "--output_type",
                                     "PLY",
                                     "--StereoFusion.num_threads",
                                     "2",
                                     "--StereoFusion.max_image_size",
                                     "100",
                                     "--StereoFusion.min_num_pixels",
                                     "3",
                                     "--StereoFusion.max_num_pixels",
                                     "100",
                                     "--StereoFusion.max_traversal_depth",
                                     "50",
                                     "--StereoFusion.max_reproj_error",
                                     "1.5",
                                     "--StereoFusion.max_depth_error",
                                     "0.02",
                                     "--StereoFusion.max_normal_error",
                                     "20",
                                     "--StereoFusion.check_num_images",
                                     "10",
                                     "--StereoFusion.cache_size",
                                     "4",
                                     "--StereoFusion.use_cache",
                                     "1"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("StereoFusion.max_traversal_depth"));
  EXPECT_TRUE(fs::exists(folder_ / "fused.ply"));
  EXPECT_TRUE(fs::exists(folder_ / "fused.ply.vis"));
}

TEST_F(StereoFusionCommand, RefusesWrongValues) {
  const ProgramResult result = Fuse({"--StereoFusion.max_depth_error", "-1"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("--StereoFusion.max_depth_error is -1, but must be"));
  EXPECT_EQ(Fuse({"--input_type", "photometric"}).exit_code, 2);
}

TEST_F(StereoFusionCommand, NeverReplacesTheWorkspacesOwnModel) {
  const auto before = FilesIn(folder_ / "sparse");
  for (const std::vector<std::string>& shard : {std::vector<std::string>{}, {"--shard", "0/2"}}) {
    std::vector<std::string> options{"--output_type", "BIN"};
    options.insert(options.end(), shard.begin(), shard.end());
    const ProgramResult result = Fuse(options, "sparse");
    EXPECT_EQ(result.exit_code, 1) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("the workspace's own model"));
  }
  EXPECT_TRUE(FilesIn(folder_ / "sparse") == before);
  EXPECT_EQ(Fuse({"--output_type", "BIN"}, "sparse_dense").exit_code, 0);
}

TEST_F(StereoFusionCommand, NothingFusedLeavesTheEarlierCloud) {
  ASSERT_EQ(Fuse({}).exit_code, 0);
  const std::string cloud = test_support::ReadBytes(folder_ / "fused.ply");
  for (const auto& photo : fs::recursive_directory_iterator(folder_ / "images"))
    if (photo.is_regular_file()) test_support::WriteBytes(photo.path(), "no image");
  const ProgramResult result = Fuse({});
  EXPECT_EQ(result.exit_code, 2) << result.errors;
  EXPECT_THAT(result.errors, ::testing::ContainsRegex("error: fusion: none of the [0-9]+ images can be fused: [^\n]*damaged"));
  EXPECT_EQ(test_support::ReadBytes(folder_ / "fused.ply"), cloud);
}

// The wall behind the sphere lies at z = 6.
TEST_F(StereoFusionCommand, ABoxBesideTheSceneIsAnErrorThatSaysWhereTheSceneLies) {
  ASSERT_EQ(Fuse({}).exit_code, 0);
  const std::string cloud = test_support::ReadBytes(folder_ / "fused.ply");
  const std::string box = (folder_ / "box.txt").string();
  test_support::WriteBytes(box, "100 0 -1 101.5 2 1");
  const auto expect_error = [&](const ProgramResult& result, const std::string& scene) {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.errors, HasSubstr("fusion: " + box + ": this box, x 100 to 101.5, y 0 to 2, z -1 to 1, holds none of the points"));
    EXPECT_THAT(result.errors, ::testing::ContainsRegex(scene + "[^\n]*Give its corners in the sparse model's coordinates"));
    EXPECT_TRUE(test_support::ReadBytes(folder_ / "fused.ply") == cloud);
  };
  expect_error(Fuse({"--bbox_path", box}), "the sparse points lie at x [^\n]* to 6\\.");
  for (const char* shard : {"0/2", "1/2", "0/2"}) Fuse({"--bbox_path", box, "--shard", shard});
  expect_error(Fuse({"--bbox_path", box}), "the sparse points lie at x ");
  EXPECT_TRUE(fs::exists(folder_ / "fused.ply.parts"));
  fs::remove_all(folder_ / "fused.ply.parts");
  SparseModel model = ReadSparseModel(folder_ / "sparse");
  model.points.clear();
  for (SparseImage& image : model.images) image.observations.clear();
  WriteSparseModelBinary(model, folder_ / "sparse");
  expect_error(Fuse({"--bbox_path", box}), "the cameras lie at x ");
}

TEST_F(StereoFusionCommand, ABoxForASmallPartOfTheSceneIsNoFault) {
  const std::string box = (folder_ / "box.txt").string();
  test_support::WriteBytes(box, "-0.1 -0.1 -100 0.1 0.1 100");
  const ProgramResult result = Fuse({"--bbox_path", box});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.errors, testing::Not(HasSubstr("few pixels gave points")));
  EXPECT_THAT(result.errors, testing::Not(HasSubstr(" 0 points")));
}

// Their folder may not be mounted where parts are joined. Without them the parts would be made anew, of nothing.
TEST_F(StereoFusionCommand, PartsWaitForPhotosThatAreAway) {
  ASSERT_EQ(Fuse({}).exit_code, 0);
  const std::string cloud = test_support::ReadBytes(folder_ / "fused.ply");
  for (const char* shard : {"0/2", "1/2"}) {
    for (int i = 0; i < 2; ++i) Fuse({"--shard", shard});
  }
  fs::rename(folder_ / "images", folder_ / "away");
  const ProgramResult result = Fuse({});
  EXPECT_EQ(result.exit_code, 2) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("none of the"));
  EXPECT_TRUE(fs::exists(folder_ / "fused.ply.parts"));
  fs::rename(folder_ / "away", folder_ / "images");
  EXPECT_EQ(Fuse({}).exit_code, 0);
  EXPECT_EQ(test_support::ReadBytes(folder_ / "fused.ply"), cloud);
}

TEST_F(StereoFusionCommand, AFullDiskLeavesNothingBehind) {
  const fs::path out = folder_ / "out/fused.ply";
  // In KiB, with the longest side of the maps: the disk is full while points are written, or only at the end, when the
  // smaller one of the two files has found its place already.
  for (const auto& [limit, size] : {std::pair{"64", "-1"}, {"32", "40"}}) {
    // The limit's signal is ignored, so that writing beyond it is an error as on a full disk.
    const ProgramResult result =
        RunProgram({"/bin/bash", "-c",
                    "trap '' XFSZ; ulimit -f \"$3\"; exec \"$0\" stereo_fusion --workspace_path \"$1\" "
                    "--output_path \"$2\" --StereoFusion.max_image_size \"$4\"",
                    PHIMVS_BINARY, folder_.path().string(), out.string(), limit, size});
    EXPECT_EQ(result.exit_code, 3) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("free some space"));
    EXPECT_TRUE(fs::is_empty(out.parent_path())) << size;
  }
}

TEST_F(StereoFusionCommand, PoissonMesherTakesTheCloud) {
  if (!HasProgram("colmap")) GTEST_SKIP() << "colmap is not installed";
  ASSERT_EQ(Fuse({}).exit_code, 0);
  const ProgramResult poisson =
      RunProgram({"colmap", "poisson_mesher", "--input_path", (folder_ / "fused.ply").string(),
                  "--output_path", (folder_ / "poisson.ply").string(), "--PoissonMeshing.depth", "6"});
  EXPECT_EQ(poisson.exit_code, 0) << poisson.output << poisson.errors;
  EXPECT_GT(fs::file_size(folder_ / "poisson.ply"), 1000u);
}

TEST_F(StereoFusionCommand, DelaunayMesherTakesTheCloudAndItsVisibility) {
  if (!HasProgram("colmap")) GTEST_SKIP() << "colmap is not installed";
  ASSERT_EQ(Fuse({}).exit_code, 0);
  const ProgramResult delaunay =
      RunProgram({"colmap", "delaunay_mesher", "--input_path", folder_.path().string(), "--output_path",
                  (folder_ / "delaunay.ply").string(), "--input_type", "dense"});
  if ((delaunay.output + delaunay.errors).find("requires CGAL") != std::string::npos) {
    GTEST_SKIP() << "this colmap was built without CGAL";
  }
  EXPECT_EQ(delaunay.exit_code, 0) << delaunay.output << delaunay.errors;
  EXPECT_GT(fs::file_size(folder_ / "delaunay.ply"), 1000u);
}

// Programs read the binary model, of an earlier cloud.
TEST_F(StereoFusionCommand, TellsOfABinaryModelBesideTheTextOne) {
  const std::string sentence = "sparse_dense holds a model in .bin files too";
  EXPECT_THAT(Fuse({"--output_type", "TXT"}, "sparse_dense").errors, testing::Not(HasSubstr(sentence)));
  EXPECT_THAT(Fuse({"--output_type", "BIN"}, "sparse_dense").errors, testing::Not(HasSubstr(sentence)));
  const ProgramResult result = Fuse({"--output_type", "TXT"}, "sparse_dense");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.errors, HasSubstr(sentence));
}

// Of no point, since the points are others.
TEST_F(StereoFusionCommand, SparseModelsHoldTheObservations) {
  const SparseModel before = ReadSparseModel(folder_ / "sparse");
  for (const std::string type : {"BIN", "TXT"}) {
    ASSERT_EQ(Fuse({"--output_type", type}, type).exit_code, 0);
    const SparseModel after = ReadSparseModel(folder_ / type);
    ASSERT_EQ(after.images.size(), before.images.size());
    for (std::size_t i = 0; i < before.images.size(); ++i) {
      const auto &expected = before.images[i].observations, &found = after.images[i].observations;
      ASSERT_GT(expected.size(), 0u);
      ASSERT_EQ(found.size(), expected.size());
      EXPECT_DOUBLE_EQ(found.back().x, expected.back().x);
      EXPECT_EQ(found.back().point3D_id, kInvalidPoint3D);
    }
  }
}

// Of the workspace's views in the three files, of poses alone, of points that no image observes, of COLMAP's rigs.
TEST_F(StereoFusionCommand, ReplacesNoModelOfAnotherProgram) {
  const SparseModel observed = ReadSparseModel(folder_ / "sparse");
  SparseModel moved = observed, scanned = observed;
  for (SparseImage& image : moved.images) image.observations.clear();
  for (SparseImage& image : scanned.images) image.observations.clear();
  moved.points.clear();
  moved.images[1].translation.x() += 1;
  for (SparsePoint& point : scanned.points) {
    point.track.clear();
    point.error = 0;
  }
  for (const std::string type : {"BIN", "TXT"}) {
    const auto write = [&](const SparseModel& model, const fs::path& folder) {
      (type == "BIN" ? WriteSparseModelBinary : WriteSparseModelText)(model, folder);
    };
    const std::string suffix = type == "BIN" ? ".bin" : ".txt";
    write(observed, folder_ / type / "observed");
    write(moved, folder_ / type / "moved");
    write(scanned, folder_ / type / "scanned");
    ASSERT_EQ(Fuse({"--output_type", type}, type + "/rigs").exit_code, 0);
    test_support::WriteBytes(folder_ / type / "rigs" / ("rigs" + suffix), "of COLMAP 4");
    test_support::WriteBytes(folder_ / type / "damaged" / ("images" + suffix), "of whomever");
    for (const std::string name : {"observed", "moved", "scanned", "rigs", "damaged"}) {
      const auto before = FilesIn(folder_ / type / name);
      for (const std::vector<std::string>& shard : {std::vector<std::string>{}, {"--shard", "0/2"}}) {
        std::vector<std::string> options{"--output_type", type};
        options.insert(options.end(), shard.begin(), shard.end());
        const ProgramResult result = Fuse(options, type + "/" + name);
        EXPECT_EQ(result.exit_code, 1) << name;
        EXPECT_THAT(result.errors, HasSubstr((folder_ / type / name).string() + " holds a sparse model that stereo_fusion did not write"));
        EXPECT_THAT(result.errors, HasSubstr("give another folder"));
      }
      EXPECT_TRUE(FilesIn(folder_ / type / name) == before) << name;
    }
  }
}

// Whatever a kill has left of it: its files get their names one after the other.
TEST_F(StereoFusionCommand, ReplacesItsOwnSparseModels) {
  for (const std::string type : {"BIN", "TXT"}) {
    const std::string suffix = type == "BIN" ? ".bin" : ".txt";
    test_support::WriteBytes(folder_ / type / ("own" + suffix), "of the user");
    ASSERT_EQ(Fuse({"--output_type", type}, type).exit_code, 0);
    const auto files = FilesIn(folder_ / type);
    EXPECT_EQ(files.size(), 4u);
    for (const std::vector<const char*>& missing : std::vector<std::vector<const char*>>{{}, {"images"}, {"images", "cameras"}}) {
      for (const char* name : missing) fs::remove(folder_ / type / (name + suffix));
      const ProgramResult again = Fuse({"--output_type", type}, type);
      EXPECT_EQ(again.exit_code, 0) << again.errors;
      EXPECT_TRUE(FilesIn(folder_ / type) == files) << missing.size();
    }
  }
}

TEST_F(StereoFusionCommand, ColmapReadsTheSparseModels) {
  if (!HasProgram("colmap")) GTEST_SKIP() << "colmap is not installed";
  for (const std::string type : {"BIN", "TXT"}) {
    ASSERT_EQ(Fuse({"--output_type", type}, type).exit_code, 0);
    const ProgramResult result =
        RunProgram({"colmap", "model_analyzer", "--path", (folder_ / type).string()});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.output + result.errors, HasSubstr("Registered images: 5"));
  }
}

}  // namespace
}  // namespace colmap_ext

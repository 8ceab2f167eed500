#include "colmap_ext/evaluation/crop_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "colmap_ext/evaluation/truth_cloud.h"
#include "tests/support/error_message.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::InputErrorOf;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using testing::HasSubstr;

// An L in the x-z plane, extruded along y from 0 to 2.
constexpr char kVolume[] =
    R"({"orthogonal_axis": "Y", "axis_min": 0, "axis_max": 2, "class_name": "SelectionPolygonVolume",
        "bounding_polygon": [[0, 9, 0], [3, 9, 0], [3, 9, 1], [1, 9, 1], [1, 9, 3], [0, 9, 3]]})";

TEST(CropVolume, IsAPolygonAlongAnAxis) {
  const TemporaryFolder folder;
  WriteBytes(folder / "crop.json", kVolume);
  const CropVolume volume = ReadCropVolume(folder / "crop.json");
  EXPECT_TRUE(volume.Contains({0.5, 1, 2.5}));
  EXPECT_TRUE(volume.Contains({2.5, 1, 0.5}));
  EXPECT_FALSE(volume.Contains({2.5, 1, 2.5}));  // in the L's notch
  EXPECT_FALSE(volume.Contains({0.5, 2.1, 2.5}));
  EXPECT_FALSE(volume.Contains({0.5, -0.1, 2.5}));
  EXPECT_FALSE(volume.Contains({-0.1, 1, 0.5}));
  WriteBytes(folder / "axis.json", R"({"orthogonal_axis": "W", "axis_min": 0, "axis_max": 3, "bounding_polygon": []})");
  EXPECT_THAT(InputErrorOf([&] { ReadCropVolume(folder / "axis.json"); }), HasSubstr("orthogonal_axis must be X, Y or Z"));
  WriteBytes(folder / "no.json", R"({"axis_min": 0})");
  EXPECT_THAT(InputErrorOf([&] { ReadCropVolume(folder / "no.json"); }), HasSubstr("no.json"));
}

TEST(Similarity, IsFourRowsWithAScale) {
  const TemporaryFolder folder;
  WriteBytes(folder / "good.txt", "0 -2 0 1\n2 0 0 2\n0 0 2 3\n0 0 0 1\n");
  const Eigen::Matrix4d m = ReadSimilarity(folder / "good.txt");
  EXPECT_EQ((m * Eigen::Vector4d(1, 0, 0, 1)).head<3>(), Eigen::Vector3d(1, 4, 3));
  WriteBytes(folder / "marked.txt", "\xEF\xBB\xBF" "0 -2 0 1\r\n2 0 0 2\r\n0 0 2 3\r\n0 0 0 1\r\n");  // as Windows' editor saves it
  EXPECT_EQ(ReadSimilarity(folder / "marked.txt"), m);
  WriteBytes(folder / "shear.txt", "1 1 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  EXPECT_THAT(InputErrorOf([&] { ReadSimilarity(folder / "shear.txt"); }), HasSubstr("shear.txt"));
  WriteBytes(folder / "short.txt", "1 0 0 0\n");
  EXPECT_THAT(InputErrorOf([&] { ReadSimilarity(folder / "short.txt"); }), HasSubstr("four rows"));
}

// Precision and recall of Tanks and Temples by hand: of the cloud's three voxels two are near the truth's, of the truth's
// four two; one point more of each lies outside the volume.
TEST(Evaluation, CountsThinnedPointsInTheVolumeAlone) {
  const TemporaryFolder folder;
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float "
      "z\nend_header\n";
  WriteBytes(folder / "truth.ply", head + "0.5 1 0.5\n0.5 1 1.5\n0.5 1 2.5\n1.5 1 0.5\n2 1 2\n");
  // In units twice as large; two points in one voxel.
  WriteBytes(folder / "cloud.ply",
             head + "0.25 0.5 0.25\n0.2501 0.5 0.25\n0.25 0.5 0.75\n1.3 0.5 0.2\n1 0.5 1\n");
  WriteBytes(folder / "crop.json", kVolume);
  WriteBytes(folder / "double.txt", "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n");
  TruthOptions truth;
  truth.path = folder / "truth.ply";
  const CloudPreparation preparation{ReadSimilarity(folder / "double.txt"),
                                     ReadCropVolume(folder / "crop.json"), true};
  CloudEvaluationOptions options;
  options.tolerances = {0.02};
  const LoadedClouds loaded = LoadClouds(folder / "cloud.ply", truth, options.voxel_size, false, preparation);
  const CloudScores scores = EvaluateCloud(loaded.clouds, options);
  EXPECT_EQ(scores.num_points, 3u);
  EXPECT_EQ(scores.num_truth, 4u);
  EXPECT_NEAR(scores.accuracy[0], 100 * 2.0 / 3, 1e-9);
  EXPECT_NEAR(scores.completeness[0], 50, 1e-9);
}

}  // namespace
}  // namespace colmap_ext

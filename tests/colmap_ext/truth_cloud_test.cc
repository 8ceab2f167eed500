#include "colmap_ext/evaluation/truth_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>

#include "colmap_ext/evaluation/cloud_evaluation.h"
#include "colmap_ext/evaluation/meshlab_project.h"
#include "colmap_ext/evaluation/ply_rows.h"
#include "phi/base/error.h"
#include "tests/support/golden_bytes.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using Eigen::Vector3d;
using test_support::GoldenBytes;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr char kTwoPoints[] =
    "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n"
    "property uchar views\nend_header\n1 2 3 1\n4 5 6 2\n";

std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const phi::InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(PlyRows, ReadsAsciiWithPropertiesInAnyOrder) {
  const TemporaryFolder folder;
  WriteBytes(folder / "a.ply",
             "ply\nformat ascii 1.0\ncomment hello\nelement vertex 2\nproperty float z\nproperty uchar red\n"
             "property float x\nend_header\n3 255 1\n30 0 nan\n");
  std::vector<std::vector<double>> rows;
  PlyRows(folder / "a.ply").ForEachRow("vertex", {"x", "z", "absent"}, [&](const double* v) {
    rows.push_back({v[0], v[1], v[2]});
  });
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0][0], 1);
  EXPECT_EQ(rows[0][1], 3);
  EXPECT_TRUE(std::isnan(rows[0][2]));
  EXPECT_TRUE(std::isnan(rows[1][0]));
  EXPECT_EQ(rows[1][1], 30);
}

TEST(PlyRows, ReadsBothByteOrders) {
  const TemporaryFolder folder;
  const std::string header = "element vertex 1\nproperty short a\nproperty float b\nend_header\n";
  WriteBytes(folder / "little.ply",
             "ply\nformat binary_little_endian 1.0\n" + header + std::string("\x02\x01\x00\x00\x80\x3f", 6));
  WriteBytes(folder / "big.ply",
             "ply\nformat binary_big_endian 1.0\n" + header + std::string("\x01\x02\x3f\x80\x00\x00", 6));
  for (const char* name : {"little.ply", "big.ply"}) {
    PlyRows(folder / name).ForEachRow("vertex", {"a", "b"}, [&](const double* v) {
      EXPECT_EQ(v[0], 258) << name;
      EXPECT_EQ(v[1], 1) << name;
    });
  }
}

// Rows i of a short i and a float 10 i, behind an element of two bytes; by the format's name.
std::string NumberedRows(const std::string& format, int num_rows) {
  std::string ply = "ply\nformat " + format + " 1.0\nelement before 2\nproperty uchar a\nelement vertex " +
                    std::to_string(num_rows) + "\nproperty short a\nproperty float b\nend_header\n";
  ply += format == "ascii" ? "1 2\n" : std::string("\1\2");
  const auto add = [&](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof(value));
    if (format == "binary_big_endian") std::reverse(bytes.begin(), bytes.end());
    ply += bytes;
  };
  for (int i = 0; i < num_rows; ++i) {
    if (format == "ascii") {
      ply += std::to_string(i) + " " + std::to_string(10 * i) + "\n";
    } else {
      add(static_cast<std::int16_t>(i));
      add(static_cast<float>(10 * i));
    }
  }
  return ply;
}

TEST(PlyRows, ChosenRowsAreThoseAtTheirPositions) {
  const TemporaryFolder folder;
  const std::vector<std::uint64_t> positions{0, 1, 7, 8, 9999, 19999};
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    WriteBytes(folder / "a.ply", NumberedRows(format, 20000));
    std::vector<std::uint64_t> found;
    PlyRows(folder / "a.ply").ForChosenRows("vertex", {"b", "absent", "a"}, positions, [&](const double* v) {
      found.push_back(static_cast<std::uint64_t>(v[2]));
      EXPECT_EQ(v[0], 10 * v[2]) << format;
      EXPECT_TRUE(std::isnan(v[1])) << format;
    });
    EXPECT_EQ(found, positions) << format;
  }
}

// A million rows of six bytes are read in several parts.
TEST(PlyRows, ChosenRowsOfALargeFile) {
  const TemporaryFolder folder;
  WriteBytes(folder / "a.ply", NumberedRows("binary_little_endian", 1000000));
  std::vector<double> found;
  PlyRows(folder / "a.ply").ForChosenRows("vertex", {"b"}, {3, 174761, 174762, 174763, 999999}, [&](const double* v) {
    found.push_back(v[0]);
  });
  EXPECT_EQ(found, (std::vector<double>{30, 1747610, 1747620, 1747630, 9999990}));
}

TEST(PlyRows, ChosenRowsOfAFileThatEndsEarlyAreAnErrorWhereverItEnds) {
  const TemporaryFolder folder;
  const std::string whole = NumberedRows("binary_little_endian", 100);
  for (const std::size_t missing : {1u, 100 * 6u, 100 * 6u + 1}) {
    WriteBytes(folder / "a.ply", whole.substr(0, whole.size() - missing));
    const PlyRows rows(folder / "a.ply");
    EXPECT_THAT(ErrorOf([&] { rows.ForChosenRows("vertex", {"a"}, {0}, [](const double*) {}); }), HasSubstr("ends before"))
        << missing;
  }
  // As many rows as would not fit any file, and their bytes no number.
  WriteBytes(folder / "a.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 9000000000000000000\nproperty double x\n"
                               "end_header\n12345678");
  EXPECT_THAT(ErrorOf([&] { PlyRows(folder / "a.ply").ForChosenRows("vertex", {"x"}, {0}, [](const double*) {}); }),
              HasSubstr("ends before"));
}

TEST(PlyRows, NamesTheFileThatEndsEarlyOrIsNoPly) {
  const TemporaryFolder folder;
  WriteBytes(folder / "short.ply",
             "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nend_header\n" +
                 std::string(7, '\0'));
  const PlyRows rows(folder / "short.ply");
  EXPECT_THAT(ErrorOf([&] { rows.ForEachRow("vertex", {"x"}, [](const double*) {}); }),
              HasSubstr("short.ply"));
  WriteBytes(folder / "text.ply", "hello\n");
  EXPECT_THAT(ErrorOf([&] { PlyRows(folder / "text.ply"); }), HasSubstr("text.ply"));
  EXPECT_THAT(ErrorOf([&] { PlyRows(folder / "absent.ply"); }), HasSubstr("absent.ply"));
}

// They counted as 0, and 1,5 as 1.
TEST(PlyRows, NamesTheFileWhoseTextHoldsNoNumber) {
  const TemporaryFolder folder;
  for (const char* word : {"abc", "1,5", "9x"}) {
    WriteBytes(folder / "a.ply",
               "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nend_header\n-nan\n" + std::string(word) + "\n");
    EXPECT_EQ(ErrorOf([&] { PlyRows(folder / "a.ply").ForEachRow("vertex", {"x"}, [](const double*) {}); }),
              (folder / "a.ply").string() + " holds '" + word + "' where a number is expected; copy or write it again");
  }
}

TEST(LoadClouds, CoordinatesThatAreListsAreNone) {
  const TemporaryFolder folder;
  WriteBytes(folder / "t.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty list uchar float y\nproperty float z\n"
             "end_header\n1 1 2 3\n");
  TruthOptions truth;
  truth.path = folder / "t.ply";
  EXPECT_EQ(ErrorOf([&] { LoadClouds(truth.path, truth, 0.01); }), truth.path.string() + " has no vertices with x, y and z");
}

TEST(LoadClouds, LeavesOutPointsThatFewViewsSee) {
  const TemporaryFolder folder;
  WriteBytes(folder / "t.ply", kTwoPoints);
  TruthOptions truth;
  truth.path = folder / "t.ply";
  EXPECT_EQ(LoadClouds(truth.path, truth, 0.01).clouds.truth.size(), 2u);
  truth.min_views = 2;
  const LoadedClouds loaded = LoadClouds(truth.path, truth, 0.01);
  ASSERT_EQ(loaded.clouds.truth.size(), 1u);
  EXPECT_EQ(loaded.clouds.truth[0].x, 4);
  EXPECT_EQ(loaded.clouds.points.size(), 2u);  // the reconstruction is taken whole
}

TEST(LoadClouds, KeepsMillimetresInGeoRegisteredScenes) {
  const TemporaryFolder folder;
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty double "
      "z\nend_header\n";
  WriteBytes(folder / "t.ply", header + "4512345.678 512345.123 6700000.5\n");
  WriteBytes(folder / "c.ply", header + "4512345.679 512345.123 6700000.5\n");
  TruthOptions truth;
  truth.path = folder / "t.ply";
  const LoadedClouds loaded = LoadClouds(folder / "c.ply", truth, 0.01);
  EXPECT_NEAR(loaded.clouds.points[0].x - loaded.clouds.truth[0].x, 0.001, 1e-6);
  EXPECT_NEAR(std::remainder(loaded.origin.x(), 0.01), 0, 1e-6);  // the voxel grid did not move
}

// As a program leaves them that divides by nothing. They ended in a crash.
TEST(LoadClouds, PointsThatNoSceneReachesAreWrong) {
  const TemporaryFolder folder;
  const auto ply = [](int power) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex 1000\n"
                       "property double x\nproperty double y\nproperty double z\nend_header\n";
    for (int i = 1; i <= 1000; ++i) {
      for (const int step : {7, 11, 13}) text += std::to_string(i * step % 1009) + "e" + std::to_string(power) + " ";
    }
    return text;
  };
  WriteBytes(folder / "t.ply", ply(-3));
  TruthOptions truth;
  truth.path = folder / "t.ply";
  for (const int power : {35, 300}) {
    WriteBytes(folder / "c.ply", ply(power));
    const LoadedClouds loaded = LoadClouds(folder / "c.ply", truth, 0.01);
    ASSERT_EQ(loaded.clouds.points.size(), 1000u);
    CloudEvaluationOptions options;
    options.tolerances = {0.01};
    const CloudScores scores = EvaluateCloud(loaded.clouds, options);
    EXPECT_THAT(scores.accuracy, testing::ElementsAre(0)) << power;
    EXPECT_THAT(scores.completeness, testing::ElementsAre(0)) << power;
  }
}

// stereo_fusion writes clouds that lie far from the origin in single precision from an offset.
TEST(LoadClouds, AddsTheOffsetThatAHeaderNames) {
  const TemporaryFolder folder;
  const auto ply = [](const std::string& comment, const std::string& type, const std::string& xyz) {
    return "ply\nformat ascii 1.0\n" + comment + "element vertex 1\nproperty " + type + " x\nproperty " + type +
           " y\nproperty " + type + " z\nend_header\n" + xyz + "\n";
  };
  WriteBytes(folder / "world.ply", ply("", "double", "4512345.678 512345.123 6700000.5"));
  WriteBytes(folder / "moved.ply", ply("comment offset 4512345 512345 6700000\n", "float", "0.679 0.123 0.5"));
  TruthOptions truth;
  truth.path = folder / "world.ply";
  const LoadedClouds of_cloud = LoadClouds(folder / "moved.ply", truth, 0.01);
  EXPECT_NEAR(of_cloud.clouds.points[0].x - of_cloud.clouds.truth[0].x, 0.001, 1e-6);
  EXPECT_NEAR(of_cloud.clouds.points[0].y, of_cloud.clouds.truth[0].y, 1e-6);
  EXPECT_NEAR(of_cloud.clouds.points[0].z, of_cloud.clouds.truth[0].z, 1e-6);
  truth.path = folder / "moved.ply";
  const LoadedClouds of_truth = LoadClouds(folder / "world.ply", truth, 0.01);
  EXPECT_NEAR(of_truth.clouds.points[0].x - of_truth.clouds.truth[0].x, -0.001, 1e-6);

  // A comment of somebody else's is none.
  for (const char* comment : {"comment offset by hand\n", "comment offset 1 2\n", "comment offset 1 2 3 4\n", "comment offset 1 2 inf\n"}) {
    WriteBytes(truth.path, ply(comment, "float", "1 2 3"));
    EXPECT_EQ(LoadClouds(truth.path, truth, 0.01).clouds.truth[0].x, 1) << comment;
  }
  WriteBytes(truth.path,
             "ply\nformat ascii 1.0\ncomment offset 10 20 30\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
             "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  truth.mesh_spacing = 0.5;
  for (const phi::Vec3f& p : LoadClouds(folder / "world.ply", truth, 0.01).clouds.truth) {
    EXPECT_TRUE(p.x >= 10 && p.y >= 20 && p.z == 30);
  }
}

// Nine times ten to the eighteenth rows that hold nothing.
TEST(PlyRows, RowsWithoutPropertiesTakeNoTime) {
  const TemporaryFolder folder;
  WriteBytes(
      folder / "a.ply",
      "ply\nformat ascii 1.0\nelement nothing 9000000000000000000\nelement vertex 1\nproperty float x\n"
      "end_header\n7\n");
  const PlyRows rows(folder / "a.ply");
  int num_rows = 0;
  rows.ForEachRow("nothing", {"x"}, [&](const double*) { ++num_rows; });
  EXPECT_EQ(num_rows, 0);
  rows.ForEachRow("vertex", {"x"}, [&](const double* v) { EXPECT_EQ(v[0], 7); });
}

// One triangle with the corners (0, 0, 0), (side, 0, 0) and (0, side, 0), and one with a corner that is no number.
std::string MeshPly(const std::string& side) {
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
         "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0\n" +
         side + " 0 0\n0 " + side + " 0\nnan 0 0\n3 0 1 2\n3 0 1 3\n";
}

TEST(LoadClouds, AMeshKeepsWithinItsMemory) {
  const TemporaryFolder folder;
  WriteBytes(folder / "c.ply", kTwoPoints);
  TruthOptions truth;
  truth.path = folder / "m.ply";
  truth.mesh_spacing = 0.1;
  truth.memory = 1 << 20;
  WriteBytes(truth.path, MeshPly("1"));
  for (const phi::Vec3f& p : LoadClouds(folder / "c.ply", truth, 0.01).clouds.truth) {
    ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
  }
  for (const std::string side : {"100", "1e9", "1e30", "1e300"}) {
    WriteBytes(truth.path, MeshPly(side));
    EXPECT_THROW(LoadClouds(folder / "c.ply", truth, 0.01), phi::ResourceError) << side;
  }
  truth.memory = 20;  // two points of the cloud and two of the truth are 48 bytes
  truth.path = folder / "c.ply";
  EXPECT_THROW(LoadClouds(folder / "c.ply", truth, 0.01), phi::ResourceError);
}

// The most that this process ever had in memory, bytes, from the last reset on; 0 where the system does not tell.
std::size_t PeakMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word == "VmHWM:" && status >> word) return std::stoul(word) * 1024;
  }
  return 0;
}
bool ResetPeakMemory() { return static_cast<bool>(std::ofstream("/proc/self/clear_refs") << 5 << std::flush); }

// Two million points, each in its own voxel, are 24 MB: what tells voxels apart must fit in what is left of 90 MB.
TEST(LoadClouds, ThinningKeepsWithinItsMemory) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer keeps what is given up";
#endif
  const TemporaryFolder folder;
  constexpr int kNumPoints = 2000000;
  {
    std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(kNumPoints) +
                      "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    for (int i = 0; i < kNumPoints; ++i) {
      const float xyz[3] = {static_cast<float>(i % 1000) + 0.5f, static_cast<float>(i / 1000) + 0.5f, 0.5f};
      ply.append(reinterpret_cast<const char*>(xyz), sizeof(xyz));
    }
    WriteBytes(folder / "t.ply", ply);
  }
  WriteBytes(folder / "c.ply", kTwoPoints);
  TruthOptions truth;
  truth.path = folder / "t.ply";
  truth.memory = 90000000;
  if (!ResetPeakMemory() || PeakMemory() == 0) GTEST_SKIP() << "the system does not tell a process's memory";
  const std::size_t before = PeakMemory();
  EXPECT_EQ(LoadClouds(folder / "c.ply", truth, 1, false, {.truth_from_cloud = {}, .crop = {}, .thin = true}).clouds.truth.size(),
            static_cast<std::size_t>(kNumPoints));
  EXPECT_LT(PeakMemory() - before, truth.memory * 5 / 4);
}

TEST(MeshLabProject, LongTagsAndManyBlanksAreRead) {
  const TemporaryFolder folder;
  const std::string blanks(400000, ' '), attribute = "label=\"" + std::string(100000, 'x') + "\" ";
  WriteBytes(folder / "a.mlp", "<MLMesh " + attribute + blanks + "filename=\"a &amp; b.ply\">\n<MLMatrix44>" +
                                   blanks +
                                   "0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1</MLMatrix44>\n</MLMesh>"
                                   "<MLMeshGroup/><MLMesh label=\"no name\"/><MLMesh\tfilename=\"c.ply\"/>");
  const auto layers = ReadMeshLabProject(folder / "a.mlp");
  ASSERT_EQ(layers.size(), 2u);
  EXPECT_EQ(layers[0].path, folder / "a & b.ply");
  EXPECT_EQ(layers[0].world_from_layer(0, 1), -1);
  EXPECT_EQ(layers[0].world_from_layer(2, 3), 7);
  EXPECT_EQ(layers[1].path, folder / "c.ply");
  EXPECT_EQ(layers[1].world_from_layer, Eigen::Matrix4d::Identity());
}

TEST(LoadClouds, SamplesAMesh) {
  const TemporaryFolder folder;
  // A unit square of two triangles as one quadrilateral.
  WriteBytes(folder / "m.ply",
             "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
             "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
             "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
  WriteBytes(folder / "c.ply", kTwoPoints);
  TruthOptions truth;
  truth.path = folder / "m.ply";
  truth.mesh_spacing = 0.1;
  const auto samples = LoadClouds(folder / "c.ply", truth, 0.01).clouds.truth;
  // Every place on the square has a sample within the spacing.
  for (float y = 0; y <= 1; y += 0.05f) {
    for (float x = 0; x <= 1; x += 0.05f) {
      float nearest = 10;
      for (const phi::Vec3f& s : samples) nearest = std::min(nearest, phi::Norm(s - phi::Vec3f{x, y, 0}));
      EXPECT_LE(nearest, 0.1f) << x << " " << y;
    }
  }
  for (const phi::Vec3f& s : samples) {
    EXPECT_TRUE(s.x >= 0 && s.x <= 1 && s.y >= 0 && s.y <= 1 && s.z == 0);
  }
}

TEST(MeshLabProject, ReadsNamesAndPoses) {
  const TemporaryFolder folder;
  WriteBytes(folder / "scans" / "s.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
             "end_header\n2 0 0\n");
  // A quarter turn about z and a shift: (2, 0, 0) comes to (0, 2, 0) + (10, 20, 30).
  WriteBytes(
      folder / "t.mlp",
      "<!DOCTYPE MeshLabDocument>\n<MeshLabProject>\n <MeshGroup>\n  <MLMesh label=\"s\" "
      "filename=\"scans/s.ply\">\n   <MLMatrix44>\n0 -1 0 10\n1 0 0 20\n0 0 1 30\n0 0 0 1\n</MLMatrix44>\n"
      "  </MLMesh>\n </MeshGroup>\n</MeshLabProject>\n");
  WriteBytes(folder / "c.ply", kTwoPoints);
  TruthOptions truth;
  truth.path = folder / "t.mlp";
  const LoadedClouds loaded = LoadClouds(folder / "c.ply", truth, 0.01);
  ASSERT_EQ(loaded.clouds.truth.size(), 1u);
  EXPECT_EQ(loaded.clouds.truth[0].x, 10);
  EXPECT_EQ(loaded.clouds.truth[0].y, 22);
  EXPECT_EQ(loaded.clouds.truth[0].z, 30);
  ASSERT_EQ(loaded.clouds.scans.size(), 1u);
  // The scanner stands at (10, 20, 30): half way to the scan point is free space.
  EXPECT_EQ(loaded.clouds.scans[0].Classify({10, 21, 30}, {0.1}), 1);
}

TEST(MeshLabProject, RefusesAMatrixThatIsNoRigidMotion) {
  const TemporaryFolder folder;
  WriteBytes(
      folder / "t.mlp",
      "<MLMesh label=\"s\" filename=\"s.ply\"><MLMatrix44>2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1 </MLMatrix44>");
  EXPECT_THAT(ErrorOf([&] { ReadMeshLabProject(folder / "t.mlp"); }), HasSubstr("s.ply"));
  WriteBytes(folder / "empty.mlp", "<MeshLabProject/>");
  EXPECT_THAT(ErrorOf([&] { ReadMeshLabProject(folder / "empty.mlp"); }), HasSubstr("names no scan"));
}

}  // namespace
}  // namespace colmap_ext

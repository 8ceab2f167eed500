// A program that uses the library may have set a locale of decimal commas, as desktop programs do. Files are the same all over the world.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <locale>
#include <string>

#include "colmap_ext/evaluation/crop_volume.h"
#include "colmap_ext/evaluation/meshlab_project.h"
#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/fusion/bounding_box_file.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/sparse_model.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::ReadBytes;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using ::testing::HasSubstr;

// 1.234,5
class Commas : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

// std::locale::global, which streams take up when they are made.
class CppLocale : public ::testing::Test {
 protected:
  CppLocale() : before_(std::locale::global(std::locale(std::locale::classic(), new Commas))) {}
  ~CppLocale() override { std::locale::global(before_); }

  const TemporaryFolder folder_;

 private:
  const std::locale before_;
};

phi::FusedBlock OnePoint(double x, double y, double z) {
  phi::FusedBlock block;
  phi::FusedPoint point;
  point.xyz[0] = x;
  point.xyz[1] = y;
  point.xyz[2] = z;
  block.points.push_back(point);
  block.view_counts.push_back(2);
  block.views = {0, 1};
  return block;
}

TEST_F(CppLocale, AnOffsetStandsInTheHeaderAsElsewhere) {
  const auto writer = MakePlyCloudWriter({.path = folder_ / "c.ply", .offset = {500126, 5600456.5, 313}});
  writer->Write(OnePoint(500127, 5600456, 312));
  writer->Commit();
  EXPECT_THAT(ReadBytes(folder_ / "c.ply"), HasSubstr("comment offset 500126 5600456.5 313\n"));
}

TEST_F(CppLocale, PointsOfATextModelHaveDecimalPoints) {
  const SparseModel model;
  std::filesystem::create_directory(folder_ / "model");
  const auto writer = MakeSparseCloudWriter(model, folder_ / "model", SparseFormat::kText);
  writer->Write(OnePoint(500127.25, 5600456, 312));
  writer->Commit();
  EXPECT_THAT(ReadBytes(folder_ / "model" / "points3D.txt"), HasSubstr("1 500127.25 5600456 312 "));
}

TEST_F(CppLocale, FilesAreReadWithDecimalPoints) {
  WriteBytes(folder_ / "box.txt", "500123.25 5600455.5 311.5\n500126.5 5600459.5 316\n");
  const phi::BoundingBox box = ReadBoundingBox(folder_ / "box.txt");
  EXPECT_EQ(box.min[0], 500123.25);
  EXPECT_EQ(box.max[1], 5600459.5);

  WriteBytes(folder_ / "far.ply", "ply\nformat ascii 1.0\ncomment offset 500126.5 5600456 313\nelement vertex 0\nend_header\n");
  EXPECT_EQ(PlyRows(folder_ / "far.ply").offset(), (std::array<double, 3>{500126.5, 5600456, 313}));

  WriteBytes(folder_ / "similarity.txt", "1 0 0 5600455.5\n0 1 0 0.25\n0 0 1 0\n0 0 0 1\n");
  const Eigen::Matrix4d similarity = ReadSimilarity(folder_ / "similarity.txt");
  EXPECT_EQ(similarity(0, 3), 5600455.5);
  EXPECT_EQ(similarity(1, 3), 0.25);

  WriteBytes(folder_ / "scans.mlp",
             "<MLMesh label=\"a\" filename=\"a.ply\"><MLMatrix44>\n1 0 0 1.5\n0 1 0 -0.25\n0 0 1 0\n0 0 0 1\n</MLMatrix44></MLMesh>");
  const auto layers = ReadMeshLabProject(folder_ / "scans.mlp");
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].world_from_layer(0, 3), 1.5);
  EXPECT_EQ(layers[0].world_from_layer(1, 3), -0.25);
}

// setlocale(), which printf and strtod go by. Python programs with a window call it.
class CLocale : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string made = (folder_ / "de_DE.UTF-8").string();
    const std::string command = "localedef -i de_DE -f UTF-8 '" + made + "' >/dev/null 2>&1";
    setenv("LOCPATH", folder_.path().c_str(), 1);
    if (std::system(command.c_str()) != 0 || !std::setlocale(LC_ALL, "de_DE.UTF-8"))
      GTEST_SKIP() << "needs localedef and the package locales";
    ASSERT_EQ(std::to_string(1.5), "1,500000");
  }
  void TearDown() override {
    std::setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
  }

  const TemporaryFolder folder_;
};

TEST_F(CLocale, CloudsInTextAreReadWithDecimalPoints) {
  WriteBytes(folder_ / "c.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
             "0.25 1.5 -2.75\n");
  std::array<double, 3> point{};
  PlyRows(folder_ / "c.ply").ForEachRow("vertex", {"x", "y", "z"}, [&](const double* row) { std::copy_n(row, 3, point.begin()); });
  EXPECT_EQ(point, (std::array<double, 3>{0.25, 1.5, -2.75}));
}

TEST_F(CLocale, FiguresHaveDecimalPoints) { EXPECT_EQ(FormatText("%.2f %%", 1.25), "1.25 %"); }

}  // namespace
}  // namespace colmap_ext

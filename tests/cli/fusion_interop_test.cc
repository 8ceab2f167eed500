// COLMAP's own fusers, at their defaults, on our maps: the cloud must have the room's extent, cover its surfaces and
// lie on them. Skipped where COLMAP or pycolmap is not installed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "colmap_ext/evaluation/ply_rows.h"
#include "tests/support/room_run.h"

namespace {

namespace fs = std::filesystem;
using test_support::HasProgram;
using test_support::ProgramResult;
using test_support::RoomRun;
using test_support::RunProgram;

colmap_ext::SyntheticRoom SmallRoom() {
  colmap_ext::SyntheticRoomOptions options;
  options.width = 200;
  options.height = 150;
  options.supersampling = 2;
  return colmap_ext::MakeSyntheticRoom(options);
}

std::vector<Eigen::Vector3d> ReadCloud(const fs::path& path) {
  std::vector<Eigen::Vector3d> points;
  colmap_ext::PlyRows(path).ForEachRow(
      "vertex", {"x", "y", "z"}, [&](const double* row) { points.emplace_back(row[0], row[1], row[2]); });
  return points;
}

// World points of the exact depth of every fourth pixel.
std::vector<Eigen::Vector3d> TruePoints(const colmap_ext::RenderedScene& scene) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const phi::Pinhole& k = scene.views[i].camera.pinhole;
    const phi::Pose& pose = scene.views[i].camera.pose;
    const phi::PlaneMap& map = *scene.truth[i];
    for (int y = 0; y < map.height(); y += 2) {
      for (int x = 0; x < map.width(); x += 2) {
        const Eigen::Vector3d ray((x + 0.5 - k.cx) / k.fx, (y + 0.5 - k.cy) / k.fy, 1);
        points.push_back(pose.rotation.transpose() * (map(x, y).depth * ray - pose.translation));
      }
    }
  }
  return points;
}

// Between the 2nd and the 98th percentile along one axis: a few wrong points do not count.
double Extent(const std::vector<Eigen::Vector3d>& points, int axis) {
  std::vector<double> values;
  for (const Eigen::Vector3d& point : points) values.push_back(point[axis]);
  std::sort(values.begin(), values.end());
  return values[values.size() * 98 / 100] - values[values.size() * 2 / 100];
}

// How a cloud looks from one view: which pixels it covers, and how many of its visible points lie on a surface.
struct CloudView {
  phi::Mask covered;
  std::int64_t visible = 0, on_surface = 0;
};

// A point that lies more than 5 % behind the surface is hidden and is left to the other views.
CloudView LookAtCloud(const colmap_ext::RenderedScene& scene, int view,
                      const std::vector<Eigen::Vector3d>& points) {
  const phi::PlaneMap& truth = *scene.truth[view];
  CloudView result{phi::Mask(truth.width(), truth.height())};
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = colmap_ext::Project(scene.views[view].camera, point);
    const int x = static_cast<int>(std::floor(p.x())), y = static_cast<int>(std::floor(p.y()));
    if (!(p.z() > 0) || x < 0 || y < 0 || x >= truth.width() || y >= truth.height()) continue;
    const double relative = p.z() / truth(x, y).depth - 1;
    if (relative > 0.05) continue;
    ++result.visible;
    if (std::abs(relative) > 0.02) continue;
    ++result.on_surface;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (result.covered.view().Contains(x + dx, y + dy)) result.covered(x + dx, y + dy) = 255;
      }
    }
  }
  return result;
}

// Textured pixels that the fusers' default of five pixels a point can serve.
double CoveredPercent(const colmap_ext::RenderedScene& scene, int view, const phi::Mask& covered) {
  const phi::Array2D<int> others = colmap_ext::CountOtherViews(scene, view);
  std::int64_t count = 0, hits = 0;
  for (std::size_t i = 0; i < covered.size(); ++i) {
    if (scene.textured[view]->data()[i] == 0 || others.data()[i] < 4) continue;
    ++count;
    hits += covered.data()[i] != 0;
  }
  return 100.0 * hits / count;
}

class FusionInterop : public testing::Test {
 protected:
  void MakeMaps() {
    run_ = std::make_unique<RoomRun>(SmallRoom());
    const ProgramResult result = run_->RunStereo();
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }

  void ExpectGoodCloud(const fs::path& cloud) {
    const std::vector<Eigen::Vector3d> points = ReadCloud(cloud);
    // A point for every 60 pixels of the eight images at least, at 5 or more pixels a point.
    ASSERT_GT(points.size(), 200u * 150 * 8 / 60);
    const std::vector<Eigen::Vector3d> truth = TruePoints(run_->scene());
    for (int axis = 0; axis < 3; ++axis) {
      // The far ends are paint that few images see: 0.17 is missing at this commit, with five pixels a point.
      EXPECT_NEAR(Extent(points, axis), Extent(truth, axis), 0.2 * Extent(truth, axis)) << "axis " << axis;
    }
    // Half of the room is paint, whose depths are what keeps the first figure from 95 (goal). At this commit: 87 and 88.
    for (const int view : {0, run_->num_views() / 2}) {
      const CloudView seen = LookAtCloud(run_->scene(), view, points);
      const double on_surface = 100.0 * seen.on_surface / seen.visible;
      const double covered = CoveredPercent(run_->scene(), view, seen.covered);
      std::printf("view %d: %.1f %% of the points on a surface, %.1f %% of the texture covered\n", view,
                  on_surface, covered);
      EXPECT_GE(on_surface, 80) << "view " << view;
      EXPECT_GE(covered, 80) << "view " << view;
    }
  }

  std::unique_ptr<RoomRun> run_;
};

TEST_F(FusionInterop, Colmap) {
  if (!HasProgram("colmap")) GTEST_SKIP() << "colmap is not installed (scripts/setup --with-colmap)";
  MakeMaps();
  const fs::path cloud = run_->dense() / "fused.ply";
  const ProgramResult result =
      RunProgram({"colmap", "stereo_fusion", "--workspace_path", run_->dense(), "--output_path", cloud},
                 {"QT_QPA_PLATFORM=offscreen"});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  ExpectGoodCloud(cloud);
  EXPECT_TRUE(fs::exists(cloud.string() + ".vis"));
}

TEST_F(FusionInterop, Pycolmap) {
  if (RunProgram({"python3", "-c", "import pycolmap"}).exit_code != 0) {
    GTEST_SKIP() << "python3 has no pycolmap (pip install pycolmap)";
  }
  MakeMaps();
  const fs::path cloud = run_->dense() / "fused.ply";
  const ProgramResult result =
      RunProgram({"python3", "-c",
                  "import sys, pycolmap; pycolmap.stereo_fusion(sys.argv[2], sys.argv[1], output_type='ply')",
                  run_->dense(), cloud});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  ExpectGoodCloud(cloud);
}

}  // namespace

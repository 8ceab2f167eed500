// point_table against the cloud of the same maps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "phi/fusion/point_confidence.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/map_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using test_support::ReadBytes;
using test_support::RunProgram;

// As the head of point_table.cc says.
struct Row {
  float xyz[3], distance;
  phi::PointTerms terms;
};

struct CloudPoint {
  float xyz[3];
  int confidence = 0;  // percent
  std::vector<std::uint32_t> views;
};

class PointTable : public ::testing::Test {
 protected:
  void SetUp() override {
    test_support::WriteMapWorkspace(scene_, folder_.path());
    const auto fused = RunProgram({PHIMVS_BINARY, "stereo_fusion", "--workspace_path", folder_.path().string(), "--output_path",
                                   (folder_ / "fused.ply").string(), "--PhiFusion.backend", "cpu"});
    ASSERT_EQ(fused.exit_code, 0) << fused.errors;
  }

  std::vector<Row> MakeTable(int stride) const {
    const auto result =
        RunProgram({PHIMVS_POINT_TABLE, folder_.path().string(), std::to_string(stride), (folder_ / "table.f32").string()});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const std::string bytes = ReadBytes(folder_ / "table.f32");
    std::vector<Row> rows(bytes.size() / sizeof(Row));
    EXPECT_EQ(bytes.size(), rows.size() * sizeof(Row));
    std::memcpy(rows.data(), bytes.data(), rows.size() * sizeof(Row));
    return rows;
  }

  // Of the .ply, whose vertices have 30 bytes and end with the confidence, and its .vis.
  std::vector<CloudPoint> ReadCloud() const {
    const std::string ply = ReadBytes(folder_ / "fused.ply"), vis = ReadBytes(folder_ / "fused.ply.vis");
    std::uint64_t num_points = 0;
    std::memcpy(&num_points, vis.data(), sizeof(num_points));
    std::vector<CloudPoint> points(num_points);
    const char *vertex = ply.data() + ply.find("end_header\n") + 11, *at = vis.data() + sizeof(num_points);
    for (CloudPoint& point : points) {
      std::memcpy(point.xyz, vertex, sizeof(point.xyz));
      point.confidence = static_cast<std::uint8_t>(vertex[29]);
      vertex += 30;
      std::uint32_t num_views = 0;
      std::memcpy(&num_views, at, sizeof(num_views));
      point.views.resize(num_views);
      std::memcpy(point.views.data(), at + sizeof(num_views), num_views * sizeof(num_views));
      at += (1 + num_views) * sizeof(num_views);
    }
    return points;
  }

  const test_support::RenderedScene scene_ = test_support::SphereScene({.width = 80, .height = 60, .focal = 75});
  const test_support::TemporaryFolder folder_;
};

// The views of a .vis file are in no order of distance, and not all of them see a point.
TEST_F(PointTable, HasEachPointsPlaceNearestCameraAndWhatItsConfidenceComesFrom) {
  const std::vector<Row> rows = MakeTable(1);
  const std::vector<CloudPoint> points = ReadCloud();
  ASSERT_EQ(rows.size(), points.size());
  ASSERT_GT(points.size(), 1000u);
  int num_not_nearest_of_all = 0;
  std::map<phi::PointTerms, int> confidences;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Vector3d place(rows[i].xyz[0], rows[i].xyz[1], rows[i].xyz[2]);
    for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(rows[i].xyz[axis], points[i].xyz[axis]) << i;
    const auto distance = [&](std::size_t view) { return (place - scene_.views[view].camera.pose.Center()).norm(); };
    double nearest = std::numeric_limits<double>::infinity(), nearest_of_all = nearest;
    for (const std::uint32_t view : points[i].views) nearest = std::min(nearest, distance(view));
    for (std::size_t view = 0; view < scene_.views.size(); ++view) nearest_of_all = std::min(nearest_of_all, distance(view));
    num_not_nearest_of_all += nearest > nearest_of_all;
    ASSERT_NEAR(rows[i].distance, nearest, 1e-5) << i;
    // Nothing is inferred here.
    ASSERT_NEAR(rows[i].terms[phi::kPointMeasured], std::log2(1.0 + static_cast<double>(points[i].views.size())), 1e-5) << i;
    const auto same = confidences.emplace(rows[i].terms, points[i].confidence).first;
    ASSERT_EQ(same->second, points[i].confidence) << i << ": equal terms, another confidence";
  }
  EXPECT_GT(num_not_nearest_of_all, 10) << "all views see all points: nothing is tested";
}

TEST_F(PointTable, StrideThinsThePointsOfAllBlocksTogether) {
  const std::vector<Row> all = MakeTable(1), some = MakeTable(7);
  ASSERT_EQ(some.size(), (all.size() + 6) / 7);
  for (std::size_t i = 0; i < some.size(); ++i) ASSERT_EQ(std::memcmp(&some[i], &all[7 * i], sizeof(Row)), 0) << i;
}

TEST_F(PointTable, FailsWhereTheTableCannotBeWritten) {
  EXPECT_EQ(RunProgram({PHIMVS_POINT_TABLE, folder_.path().string(), "1", "/dev/full"}).exit_code, 3);
  EXPECT_EQ(RunProgram({PHIMVS_POINT_TABLE, (folder_ / "nowhere").string(), "1", (folder_ / "t").string()}).exit_code, 1);
}

}  // namespace

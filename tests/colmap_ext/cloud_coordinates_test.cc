#include "colmap_ext/fusion/cloud_coordinates.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/sparse_model.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {
namespace {

constexpr double kFocal = 100;  // pixels

struct WorldCase {
  const char* name;
  double distance;  // of the cameras' middle from the origin, along x
  double spread;    // of either camera from that middle, along x
  double spacing;   // of points; 0: there are none
  double offset;    // along x
  bool in_doubles;
  double las_scale;
};

// Two cameras that look along z, and a point before the first at which a pixel spans `spacing`.
Workspace MakeWorld(const WorldCase& world) {
  SparseModel model;
  model.cameras[1] = {1, 1, 64, 48, {kFocal, kFocal, 32, 24}};
  for (std::uint32_t id = 1; id <= 2; ++id) {
    SparseImage image;
    image.image_id = id;
    image.camera_id = 1;
    image.name = std::to_string(id) + ".png";
    const double center = world.distance + (id == 1 ? -world.spread : world.spread);
    image.translation = {-center, 0, 0};
    model.images.push_back(image);
  }
  if (world.spacing > 0) {
    SparsePoint point;
    point.point3D_id = 1;
    point.xyz = {world.distance - world.spread, 0, kFocal * world.spacing};
    point.track = {{1, 0}};
    model.images[0].observations.push_back({32, 24, 1});
    model.points.push_back(point);
  }
  return Workspace(std::move(model), {}, -1);
}

// Single precision has 24 bits: at 500,000 a step of 0.03, which is more than a tenth of a spacing of 0.02, and less than one of 5.
TEST(ChooseCoordinates, FollowDistanceAndSpacing) {
  const WorldCase cases[] = {
      {"near", 0, 1, 0.02, 0, false, 1e-4},
      {"near and coarse", 0, 1, 0.5, 0, false, 1e-3},
      {"far", 500000, 1, 0.02, 500000, false, 1e-4},
      {"far and coarse", 500000, 1, 5, 0, false, 1e-3},
      {"far and wide", 500000, 50000, 0.02, 500000, true, 1e-4},
      {"near without points", 0, 1, 0, 0, false, 1e-3},
      {"a little away without points", 900, 1, 0, 0, false, 1e-3},
      {"far without points", 500000, 1, 0, 500000, false, 1e-3},
      {"far and wide without points", 500000, 50000, 0, 500000, true, 1e-3},
  };
  for (const WorldCase& world : cases) {
    const CloudCoordinates coordinates = ChooseCoordinates(MakeWorld(world));
    EXPECT_EQ(coordinates.offset, (std::array<double, 3>{world.offset, 0, 0})) << world.name;
    EXPECT_EQ(coordinates.in_doubles, world.in_doubles) << world.name;
    EXPECT_DOUBLE_EQ(coordinates.las_scale, world.las_scale) << world.name;
  }
}

// Headers name the offset: "-0" would be read as another.
TEST(ChooseCoordinates, OffsetsAreWholeAndOfNoNegativeZero) {
  std::vector<double> asked;
  const CloudCoordinates coordinates = ChooseCoordinates(0.02, {499999.6, -0.4, -7.6}, [&](const Eigen::Vector3d& offset) {
    asked.push_back(offset.x());
    return offset.x() == 0 ? 500000.0 : 10.0;
  });
  EXPECT_EQ(coordinates.offset, (std::array<double, 3>{500000, 0, -8}));
  EXPECT_FALSE(std::signbit(coordinates.offset[1]));
  EXPECT_FALSE(coordinates.in_doubles);
  EXPECT_EQ(asked, (std::vector<double>{0, 500000})) << "precision is asked for from the offset that is written";
}

TEST(ChooseCoordinates, AHundredthOfTheCoordinatesMayBeOutliers) {
  std::vector<double> coordinates(200, 3);
  coordinates[7] = coordinates[90] = 1e9;
  EXPECT_EQ(LargestWithoutOutliers(coordinates), 3);
  coordinates[150] = 1e9;
  EXPECT_EQ(LargestWithoutOutliers(coordinates), 1e9);
  EXPECT_EQ(LargestWithoutOutliers({}), 0);
}

}  // namespace
}  // namespace colmap_ext

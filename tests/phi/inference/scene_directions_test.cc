#include "phi/inference/scene_directions.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

namespace phi {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const Pinhole kPinhole{320, 240, 300, 310, 150, 130};

// Inverse depth at array indices (x, y), whose pixel's centre is half a pixel farther, of the plane normal . X = distance.
double InverseDepth(const Eigen::Vector3d& normal, double distance, double x, double y) {
  const Pinhole& k = kPinhole;
  return normal.dot(Eigen::Vector3d((x + 0.5 - k.cx) / k.fx, (y + 0.5 - k.cy) / k.fy, 1)) / distance;
}

ImagePlane PlaneOf(const Eigen::Vector3d& normal, double distance) {
  const auto at = [&](double x, double y) { return InverseDepth(normal, distance, x, y); };
  return {at(0, 0), at(1, 0) - at(0, 0), at(0, 1) - at(0, 0)};
}

Eigen::Vector3d Turned(const Eigen::Vector3d& v, double degrees, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(degrees * kDegree, axis.normalized()) * v;
}

// Cells in a rectangle of the image, on the plane `normal`; the plane that is said to go through them is tilted.
CarriedPlane Carried(const Eigen::Vector3d& normal, double distance, int x0, int y0, int columns, int rows, double tilt = 0) {
  CarriedPlane plane{PlaneOf(Turned(normal, tilt, {1, 0.4, 0.2}), distance), {}};
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const auto x = static_cast<float>(x0 + 10 * i), y = static_cast<float>(y0 + 10 * j);
      const double w = InverseDepth(normal, distance, x, y);
      plane.cells.push_back({x, y, w, 0.003 * w, i, j});
    }
  }
  return plane;
}

// A room seen askew: floor, two walls and a cupboard before one of them, and a lid that leans.
struct AskewRoom {
  Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.5, Eigen::Vector3d(0.3, 1, -0.2).normalized()).toRotationMatrix();
  std::vector<CarriedPlane> planes;

  explicit AskewRoom(int lid_columns = 5) {
    const Eigen::Vector3d x = rotation.col(0), y = rotation.col(1), z = rotation.col(2);
    planes = {Carried(y, 1.2, 20, 170, 20, 6, 0.8), Carried(z, 4, 0, 20, 12, 10, -0.9), Carried(z, 3.6, 150, 60, 6, 10, 0.7),
              Carried(x, 2, 230, 20, 8, 12, 0.6), Carried((x + 2 * y + 3 * z).normalized(), 3, 100, 20, lid_columns, 5)};
  }

  // Of the directions from the room's, degrees.
  double ErrorOf(const SceneDirections& found) const {
    double most = 0;
    for (int i = 0; i < 3; ++i) {
      const double cosine = (found.columns().transpose() * rotation.col(i)).cwiseAbs().maxCoeff();
      most = std::max(most, std::acos(std::min(1.0, cosine)) / kDegree);
    }
    return most;
  }
};

// Each of the planes is off by 0.6 to 0.9 degrees; what they share with their cells is not. Half a pixel turns a direction by 0.1 degrees.
TEST(SceneDirections, AreThoseOfTheCellsOfAllPlanesAtRightAngles) {
  const AskewRoom room;
  const auto found = FindDirections(room.planes, kPinhole);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(room.ErrorOf(*found), 0.01);
  EXPECT_LT((found->columns().transpose() * found->columns() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
}

// A tenth of a plane's cells are of things three tolerances before it, all at one side.
TEST(SceneDirections, CellsThatStandBeforeTheirPlaneCountLittle) {
  AskewRoom room;
  for (CarriedPlane& plane : room.planes) {
    for (std::size_t i = 0; i < plane.cells.size() / 10; ++i) plane.cells[i].w += 3 * plane.cells[i].tolerance;
  }
  const auto found = FindDirections(room.planes, kPinhole);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(room.ErrorOf(*found), 0.15);
}

// 396 cells stand along the directions.
TEST(SceneDirections, AreNoneWhereMostCellsLieOnPlanesThatStandOtherwise) {
  EXPECT_TRUE(FindDirections(AskewRoom(78).planes, kPinhole).has_value());
  EXPECT_FALSE(FindDirections(AskewRoom(80).planes, kPinhole).has_value());
}

TEST(SceneDirections, AreNoneWithoutTwoPlanesAtRightAngles) {
  const AskewRoom room;
  EXPECT_FALSE(FindDirections({}, kPinhole).has_value());
  EXPECT_FALSE(FindDirections(std::vector{room.planes[1], room.planes[2]}, kPinhole).has_value());
}

// By hand: the image's axes. Straight ahead at distance 1 all inverse depths are 1; a floor one below has none at the height of the
// principal point, whose index is half a pixel less, and 1 a focal length below.
TEST(SceneDirections, PlanesAlongThemLieAtDistanceOne) {
  const SceneDirections directions(Eigen::Matrix3d::Identity(), kPinhole);
  const ImagePlane ahead = directions.PlaneAlong(2), floor = directions.PlaneAlong(1);
  EXPECT_DOUBLE_EQ(ahead.InverseDepth(17, 200), 1);
  EXPECT_NEAR(floor.InverseDepth(17, 129.5), 0, 1e-12);
  EXPECT_NEAR(floor.InverseDepth(17, 129.5 + 310), 1, 1e-12);
}

TEST(SceneDirections, TellHowFarAPlaneLeansFromTheNearest) {
  const SceneDirections directions(Eigen::Matrix3d::Identity(), kPinhole);
  const Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(directions.AngleTo(PlaneOf(ahead, 3)), 0, 1e-6);
  EXPECT_NEAR(directions.AngleTo(PlaneOf(Turned(ahead, 10, {1, 0, 0}), 3)), 10 * kDegree, 1e-9);
  EXPECT_NEAR(directions.AngleTo(PlaneOf(Turned(ahead, 80, {0, 1, 0}), -2)), 10 * kDegree, 1e-9) << "from another one";
}

}  // namespace
}  // namespace phi

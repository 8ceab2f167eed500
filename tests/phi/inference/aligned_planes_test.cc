#include "phi/inference/aligned_planes.h"

#include <vector>

#include <gtest/gtest.h>

namespace phi {
namespace {

// Inverse depth 0 at x = 20, where its plane is seen edge on, and negative to the left.
const ImagePlane kDirection{-0.2, 0.01, 0.002};

// A row of cells on the direction's plane at that inverse distance.
std::vector<AnchorCell> Row(double inverse, int count, float x0 = 100, float weight = 1) {
  std::vector<AnchorCell> cells;
  for (int i = 0; i < count; ++i) {
    const float x = x0 + 10 * static_cast<float>(i);
    const double w = inverse * kDirection.InverseDepth(x, 0);
    cells.push_back({x, 0, w, 0.003 * w, i, 0, true, weight});
  }
  return cells;
}

std::vector<AnchorCell> operator+(std::vector<AnchorCell> a, const std::vector<AnchorCell>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// Inverse distances.
std::vector<double> Found(const std::vector<AnchorCell>& cells) {
  std::vector<double> inverse;
  for (const ImagePlane& plane : PlanesAlong(kDirection, cells)) {
    inverse.push_back(plane.a / kDirection.a);
    EXPECT_NEAR(plane.b / kDirection.b, inverse.back(), 1e-12);
    EXPECT_NEAR(plane.c / kDirection.c, inverse.back(), 1e-12);
  }
  return inverse;
}

void ExpectNear(const std::vector<double>& found, const std::vector<double>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-6);
}

TEST(AlignedPlanes, ThoseOfMostCellsComeFirst) {
  ExpectNear(Found(Row(0.5, 4) + Row(0.25, 6) + Row(0.8, 5)), {0.25, 0.8, 0.5});
}

TEST(AlignedPlanes, CellsCountByTheirWeights) {
  ExpectNear(Found(Row(0.5, 4, 100, 2) + Row(0.25, 6)), {0.5, 0.25});
}

TEST(AlignedPlanes, FewCellsCarryNone) {
  EXPECT_TRUE(Found(Row(0.5, 3, 100, 0.99f)).empty());
  EXPECT_EQ(Found(Row(0.5, 3, 100, 1.01f)).size(), 1u);
  EXPECT_TRUE(Found({}).empty());
}

// Left of x = 20 a plane in front of the camera is a negative multiple.
TEST(AlignedPlanes, MayLieAtEitherSideOfTheCamera) {
  auto left = Row(-0.5, 4, -40);
  for (AnchorCell& cell : left) cell.tolerance = 0.003 * cell.w;
  ExpectNear(Found(left + Row(0.25, 5)), {0.25, -0.5});
}

// Eight cells half a tolerance off each other are one plane, through their middle; ten tolerances off, they are two.
TEST(AlignedPlanes, CellsWithinTheirToleranceAreOnePlane) {
  ExpectNear(Found(Row(0.5, 4) + Row(0.50075, 4, 150)), {0.500375});
  EXPECT_EQ(Found(Row(0.5, 4) + Row(0.515, 4, 150)).size(), 2u);
}

// Half way between cells one and a half tolerances apart each counts 1 - 0.75^2: eleven count 4.8 there, six on their own plane 6.
TEST(AlignedPlanes, CellsOfTwoPlanesAreNotTakenForOneBetweenThem) {
  const double other = 0.5 + 1.5 * 0.003 * 0.5;
  ExpectNear(Found(Row(0.5, 6) + Row(other, 5, 160)), {0.5, other});
}

TEST(AlignedPlanes, AreFourAtMost) {
  EXPECT_EQ(Found(Row(0.1, 4) + Row(0.2, 4) + Row(0.3, 4) + Row(0.4, 4) + Row(0.5, 4)).size(), 4u);
}

// A cell that might lie anywhere is on no plane, and one that is seen edge on neither.
TEST(AlignedPlanes, VagueCellsAreLeftOut) {
  auto vague = Row(0.5, 6);
  for (AnchorCell& cell : vague) cell.tolerance = 0.6 * cell.w;
  EXPECT_TRUE(Found(vague).empty());
  std::vector<AnchorCell> edge_on(6, AnchorCell{20, 0, 0.3, 0.001, 0, 0});
  EXPECT_TRUE(Found(edge_on).empty());
}

}  // namespace
}  // namespace phi

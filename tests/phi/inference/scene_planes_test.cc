#include "phi/inference/scene_planes.h"

#include <cmath>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <Eigen/Geometry>

#include "tests/support/centered_view.h"

namespace phi {
namespace {

// Walls n . X = d in world coordinates; the reference camera is the world's frame.
struct Wall {
  Eigen::Vector3d normal;
  double offset;

  // (u, v) in K's coordinates. In the camera's frame X' = R X + t the wall is (R n) . X' = d + (R n) . t.
  double InverseDepth(const Camera& camera, double u, double v) const {
    const Pinhole& k = camera.pinhole;
    const Eigen::Vector3d n = camera.pose.rotation * normal;
    return n.dot(Eigen::Vector3d((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1)) / (offset + n.dot(camera.pose.translation));
  }
};
const Wall kWall{{0.45, 0.2, -0.87}, -2.61}, kBookcase{{-0.1, 0.05, -1}, -2};

// The reference measures a bookcase at its right and nothing of the wall; two source views, of another size, aside and askew,
// measure pictures on the wall: squares of 24 pixels, every 48.
struct RoomScene {
  SceneView reference = test_support::CenteredView(7, 320, 240, 300);
  SceneView sources[2] = {test_support::CenteredView(8, 300, 260, 240), test_support::CenteredView(9, 300, 260, 240)};
  std::shared_ptr<MeasurementMap> measured;
  std::vector<std::shared_ptr<MeasuredDepths>> source_depths;

  RoomScene() {
    const double aside[2] = {0.4, -0.3};
    for (int i = 0; i < 2; ++i) {
      Pose& pose = sources[i].camera.pose;
      pose.rotation = Eigen::AngleAxisd(0.3 * aside[i], Eigen::Vector3d(0.3, 1, 0.2).normalized()).toRotationMatrix();
      pose.translation = -pose.rotation * Eigen::Vector3d(aside[i], -0.1, 0.2);
      DepthMap depths(300, 260);
      for (int y = 0; y < 260; ++y) {
        for (int x = 0; x < 300; ++x) {
          if (x % 48 >= 24 || y % 48 >= 24) continue;
          depths(x, y) = static_cast<float>(1 / kWall.InverseDepth(sources[i].camera, x + 0.5, y + 0.5));
        }
      }
      source_depths.push_back(std::make_shared<MeasuredDepths>(AllMeasured(depths)));
    }
    PlaneMap own(320, 240);
    for (int y = 0; y < 240; ++y) {
      for (int x = 260; x < 320; ++x) {
        own(x, y) = {{0, 0, -1}, static_cast<float>(1 / kBookcase.InverseDepth(reference.camera, x + 0.5, y + 0.5))};
      }
    }
    measured = std::make_shared<MeasurementMap>(AllMeasured(own));
  }

  InferenceInput Input() const {
    InferenceInput input;
    input.reference = {&reference, std::make_shared<GrayImage>(320, 240, std::uint8_t{128})};
    for (const SceneView& source : sources)
      input.sources.push_back({&source, std::make_shared<GrayImage>(300, 260, std::uint8_t{128})});
    input.measured = measured;
    input.source_depths = {source_depths.begin(), source_depths.end()};
    return input;
  }

  std::vector<CarriedPlane> Carried(const Rules& rules = {}) const {
    const DepthPrecision precision(reference.camera, {&sources[0].camera, &sources[1].camera});
    return FindScenePlanes(Input(), {0.003f, 3, precision}, rules);
  }
  std::vector<ImagePlane> Planes(const Rules& rules = {}) const {
    const std::vector<CarriedPlane> planes = Carried(rules);
    return {planes.begin(), planes.end()};
  }

  // The greatest difference of the nearest plane to the wall over the image's corners, relative.
  double ErrorOf(const Wall& wall, const std::vector<ImagePlane>& planes) const {
    double least = 1e9;
    for (const ImagePlane& plane : planes) {
      double most = 0;
      for (const auto& [x, y] : {std::pair{0, 0}, {319, 0}, {0, 239}, {319, 239}}) {
        const double truth = wall.InverseDepth(reference.camera, x + 0.5, y + 0.5);
        most = std::max(most, std::abs(plane.InverseDepth(x, y) / truth - 1));
      }
      least = std::min(least, most);
    }
    return least;
  }
};

// Half a pixel aside the wall is 0.09 % nearer.
TEST(ScenePlanes, PicturesThatOtherViewsMeasuredCarryTheWall) {
  const RoomScene room;
  const std::vector<ImagePlane> planes = room.Planes();
  EXPECT_LT(room.ErrorOf(kWall, planes), 2e-4);
  EXPECT_LT(room.ErrorOf(kBookcase, planes), 2e-4);
  EXPECT_EQ(planes.size(), 2u);
}

TEST(ScenePlanes, ComeWithTheirCells) {
  const std::vector<CarriedPlane> planes = RoomScene().Carried();
  ASSERT_EQ(planes.size(), 2u);
  EXPECT_NE(planes[0].cells.size(), planes[1].cells.size());
  for (const CarriedPlane& plane : planes) {
    EXPECT_GE(plane.cells.size(), 25u);
    for (const AnchorCell& cell : plane.cells) EXPECT_LT(std::abs(cell.Off(plane)), 1);
  }
}

TEST(ScenePlanes, WhatOneOtherViewAloneMeasuredCarriesNone) {
  RoomScene room;
  for (PixelState& state : room.source_depths[1]->states) state = PixelState::kNone;
  EXPECT_GT(room.ErrorOf(kWall, room.Planes()), 0.02);
}

// Two sources that look past the reference image, from a step to its sides: what is measured there, up to half a side away, carries
// planes too. Part: of the reference's image plane, pixels.
TEST(ScenePlanes, WhatLiesBesideTheImageCarriesThemUpToHalfASideAway) {
  struct Part {
    int u, v, width, height;
  };
  const auto error = [](const Part& part) {
    RoomScene room;
    const double aside[2] = {0.1, -0.1};
    for (int i = 0; i < 2; ++i) {
      room.sources[i] = test_support::CenteredView(room.sources[i].image_id, part.width, part.height, 300);
      Camera& camera = room.sources[i].camera;
      camera.pinhole.cx = 160 - part.u;
      camera.pinhole.cy = 120 - part.v;
      camera.pose.translation = {-aside[i], 0, 0};
      DepthMap depths(part.width, part.height);
      for (int y = 0; y < part.height; ++y) {
        for (int x = 0; x < part.width; ++x) depths(x, y) = static_cast<float>(1 / kWall.InverseDepth(camera, x + 0.5, y + 0.5));
      }
      room.source_depths[i] = std::make_shared<MeasuredDepths>(AllMeasured(depths));
    }
    return room.ErrorOf(kWall, room.Planes());
  };
  // Right, below, left, above; then as far again.
  for (const Part& part : {Part{330, 20, 140, 200}, {20, 250, 280, 100}, {-150, 20, 140, 200}, {20, -110, 280, 100}}) {
    EXPECT_LT(error(part), 1e-3) << part.u << ", " << part.v;
  }
  for (const Part& part : {Part{500, 20, 140, 200}, {20, 380, 280, 100}, {-320, 20, 140, 200}, {20, -240, 280, 100}}) {
    EXPECT_GT(error(part), 0.02) << part.u << ", " << part.v;
  }
}

TEST(ScenePlanes, AreTheSameForAnyNumberOfThreads) {
  const RoomScene room;
  const std::vector<ImagePlane> many = room.Planes();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<ImagePlane> few = room.Planes();
  ASSERT_EQ(many.size(), few.size());
  EXPECT_EQ(std::memcmp(many.data(), few.data(), many.size() * sizeof(ImagePlane)), 0);
}

TEST(ScenePlanes, AreNoneWithoutTheRule) {
  Rules rules;
  rules.Set(Rule::kScenePlanes, 0);
  EXPECT_TRUE(RoomScene().Planes(rules).empty());
}

}  // namespace
}  // namespace phi

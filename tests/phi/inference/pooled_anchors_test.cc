#include "phi/inference/pooled_anchors.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <Eigen/Geometry>

#include "phi/inference/infer.h"
#include "phi/inference/region_planes.h"
#include "tests/support/centered_view.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

// The wall n . X = d in world coordinates; the reference camera is the world's frame.
const Eigen::Vector3d kWallNormal = Eigen::Vector3d(0.45, 0.2, -0.87);
const double kWallOffset = kWallNormal.dot(Eigen::Vector3d(0, 0, 3));

// (u, v) in K's coordinates. In the camera's frame X' = R X + t the wall is (R n) . X' = d + (R n) . t.
double WallInverseDepth(const Camera& camera, double u, double v) {
  const Pinhole& k = camera.pinhole;
  const Eigen::Vector3d normal = camera.pose.rotation * kWallNormal;
  const Eigen::Vector3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1);
  return normal.dot(ray) / (kWallOffset + normal.dot(camera.pose.translation));
}

using test_support::CenteredView;

// Plain images: the whole wall is one region. The source view has another size, stands 0.4 m aside and looks askew.
struct WallScene {
  SceneView reference = CenteredView(7, 160, 120, 150), source = CenteredView(8, 300, 260, 240);
  std::shared_ptr<GrayImage> reference_image = std::make_shared<GrayImage>(160, 120, std::uint8_t{128});
  std::shared_ptr<GrayImage> source_image = std::make_shared<GrayImage>(300, 260, std::uint8_t{130});
  std::shared_ptr<PlaneMap> measured = std::make_shared<PlaneMap>(160, 120);
  std::shared_ptr<DepthMap> source_depths = std::make_shared<DepthMap>(300, 260);

  WallScene() {
    Pose& pose = source.camera.pose;
    pose.rotation = Eigen::AngleAxisd(0.12, Eigen::Vector3d(0.3, 1, 0.2).normalized()).toRotationMatrix();
    pose.translation = -pose.rotation * Eigen::Vector3d(0.4, -0.1, 0.2);
    for (int y = 0; y < 260; ++y) {
      for (int x = 0; x < 300; ++x) {
        const double w = WallInverseDepth(source.camera, x + 0.5, y + 0.5);
        (*source_depths)(x, y) = static_cast<float>(1 / w);
      }
    }
    // The reference's own: 20 x 20 pixels in a corner, bent by up to half a percent.
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < 20; ++x) {
        const double bend = 1 + 0.005 * (x + y - 19) / 19;
        const double w = WallInverseDepth(reference.camera, x + 0.5, y + 0.5) * bend;
        (*measured)(x, y) = {{0, 0, -1}, static_cast<float>(1 / w)};
      }
    }
  }

  InferenceInput Input() const {
    InferenceInput input;
    input.reference = {&reference, reference_image};
    input.sources = {{&source, source_image}};
    input.measured = std::make_shared<const MeasurementMap>(AllMeasured(*measured));
    input.source_depths = {std::make_shared<const MeasuredDepths>(AllMeasured(*source_depths))};
    return input;
  }

  RegionPlanes Planes(std::vector<PooledAnchor> pooled) const {
    Array2D<float> anchors(160, 120);
    for (std::size_t i = 0; i < anchors.size(); ++i) {
      if (measured->data()[i].depth > 0) anchors.data()[i] = 1 / measured->data()[i].depth;
    }
    return RegionPlanes(SharedRegions(*reference_image), std::as_const(anchors).view(), 7,
                        {.pooled = std::move(pooled), .scene = {}, .views = {}, .sources = {}, .precision = {}});
  }

  // Of the plane far from the reference's own anchors, relative.
  double ErrorInTheFarCorner(const RegionPlane& plane) const {
    const double truth = WallInverseDepth(reference.camera, 150.5, 110.5);
    return std::abs(plane.a + plane.b * 150 + plane.c * 110 - truth) / truth;
  }
};

// Looks along the same axis, half a metre to the right. A point that its pixel (100, 90) measured 3 m away lies at
// 3 * ((100.5 - 160) / 300, (90.5 - 120) / 300, 1) + (0.5, 0, 0) = (-0.095, -0.295, 3), which the reference sees at
// (150 * -0.095 / 3 + 80, 150 * -0.295 / 3 + 60) = (75.25, 45.25): in pixel (75, 45).
struct OnePointScene {
  SceneView reference = CenteredView(1, 160, 120, 150), source = CenteredView(2, 320, 240, 300);
  GrayImage reference_image = GrayImage(160, 120, 128), source_image = GrayImage(320, 240, 128);
  MeasurementMap measured = AllMeasured(PlaneMap(160, 120));
  MeasuredDepths source_depths = AllMeasured(DepthMap(320, 240));

  OnePointScene() {
    source.camera.pose.translation = {-0.5, 0, 0};
    PutSource(3, PixelState::kMeasured);
  }

  void PutSource(float depth, PixelState state) {
    source_depths.depths(100, 90) = depth;
    source_depths.states(100, 90) = state;
  }
  void Put(int x, int y, float depth, PixelState state) {
    measured.planes(x, y) = {{0, 0, -1}, depth};
    measured.states(x, y) = state;
  }

  InferenceInput Input() const {
    InferenceInput input;
    input.reference = {&reference, std::make_shared<GrayImage>(reference_image)};
    input.sources = {{&source, std::make_shared<GrayImage>(source_image)}};
    input.measured = std::make_shared<const MeasurementMap>(measured);
    input.source_depths = {std::make_shared<const MeasuredDepths>(source_depths)};
    return input;
  }

  std::size_t NumPooled() const { return PoolAnchors(Input()).size(); }
};

TEST(PooledAnchors, APointLandsWhereTheReferenceSeesIt) {
  const std::vector<PooledAnchor> pooled = PoolAnchors(OnePointScene().Input());
  ASSERT_EQ(pooled.size(), 1u);
  EXPECT_NEAR(pooled[0].x, 74.75f, 2e-5f);
  EXPECT_NEAR(pooled[0].y, 44.75f, 2e-5f);
  EXPECT_NEAR(pooled[0].inverse_depth, 1 / 3.0f, 1e-7f);
  EXPECT_EQ(pooled[0].PixelX(), 75);
  EXPECT_EQ(pooled[0].PixelY(), 45);
}

TEST(PooledAnchors, APointOfOtherBrightnessAddsNothing) {
  OnePointScene scene;
  for (const int change : {-6, 6, -7, 7}) {
    scene.source_image(100, 90) = static_cast<std::uint8_t>(128 + change);
    EXPECT_EQ(scene.NumPooled(), std::abs(change) == 6 ? 1u : 0u) << change;
  }
}

// The source is a quarter brighter. Where both views measured the wall's left half that shows; where they share a corner of 400
// pixels only, which the sparse sampling meets about 16 times, it may be chance.
TEST(PooledAnchors, AnotherExposureIsMeasuredWhereBothViewsMeasured) {
  WallScene scene;
  std::fill_n(scene.source_image->data(), scene.source_image->size(), std::uint8_t{160});
  EXPECT_TRUE(PoolAnchors(scene.Input()).empty());
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 80; ++x) {
      const double w = WallInverseDepth(scene.reference.camera, x + 0.5, y + 0.5);
      (*scene.measured)(x, y) = {{0, 0, -1}, static_cast<float>(1 / w)};
    }
  }
  EXPECT_GT(PoolAnchors(scene.Input()).size(), 1000u);
  // What differs beyond the exposure still counts: 128 is expected, 136 is there.
  std::fill_n(scene.reference_image->data() + 90 * 160, 30 * 160, std::uint8_t{136});
  for (const PooledAnchor& anchor : PoolAnchors(scene.Input())) ASSERT_LT(anchor.PixelY(), 90);
  // A depth at which the views do not agree tells nothing of the exposure.
  for (std::size_t i = 0; i < scene.measured->size(); ++i) scene.measured->data()[i].depth *= 1.03f;
  EXPECT_TRUE(PoolAnchors(scene.Input()).empty());
}

// The reference's camera made its upper part brighter by a fifth than its lower part. Its left half, which it measured, tells so.
TEST(PooledAnchors, TonesAreToldByWhatBothViewsMeasured) {
  WallScene scene;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      (*scene.reference_image)(x, y) = static_cast<std::uint8_t>(128 * std::exp(0.1 * std::cos(M_PI * (y + 0.5) / 120)) + 0.5);
      if (x >= 80) continue;
      const double w = WallInverseDepth(scene.reference.camera, x + 0.5, y + 0.5);
      (*scene.measured)(x, y) = {{0, 0, -1}, static_cast<float>(1 / w)};
    }
  }
  const auto num_above = [&](const Rules& rules) {
    const std::vector<PooledAnchor> pooled = PoolAnchors(scene.Input(), rules);
    return std::count_if(pooled.begin(), pooled.end(), [](const PooledAnchor& anchor) { return anchor.PixelY() < 20; });
  };
  Rules off;
  off.Set(Rule::kPhotoTones, 0);
  EXPECT_EQ(num_above(off), 0);
  EXPECT_GT(num_above({}), 500);
}

TEST(PooledAnchors, AMeasuredPixelIsLeftAlone) {
  OnePointScene scene;
  scene.Put(74, 45, 3, PixelState::kMeasured);
  scene.Put(75, 44, 3, PixelState::kMeasured);
  EXPECT_EQ(scene.NumPooled(), 1u);
  scene.Put(75, 45, 2, PixelState::kMeasured);
  EXPECT_EQ(scene.NumPooled(), 0u);
}

TEST(PooledAnchors, CluesCountAsMeasured) {
  OnePointScene scene;
  scene.PutSource(3, PixelState::kClue);
  EXPECT_EQ(scene.NumPooled(), 1u);
  scene.Put(75, 45, 2, PixelState::kClue);
  EXPECT_EQ(scene.NumPooled(), 0u);
}

TEST(PooledAnchors, APointThatTheReferenceCannotSeeAddsNothing) {
  OnePointScene scene;
  scene.reference.camera.pose.translation = {0, 0, -2.5};  // half a metre ahead: at (51.5, cy - 88.5)
  scene.reference.camera.pinhole.cy = 100;
  EXPECT_EQ(scene.NumPooled(), 1u);
  // Half a metre behind. Projected all the same, it would land within the image, at (108.5, cy + 88.5).
  scene.reference.camera.pose.translation = {0, 0, -3.5};
  scene.reference.camera.pinhole.cy = 22;
  EXPECT_EQ(scene.NumPooled(), 0u);
  // A hundredth of a pixel beside the image, and within it: u = cx - 4.75.
  scene.reference.camera.pose.translation = {0, 0, 0};
  scene.reference.camera.pinhole.cx = 4.74;
  EXPECT_EQ(scene.NumPooled(), 0u);
  scene.reference.camera.pinhole.cx = 4.76;
  EXPECT_EQ(scene.NumPooled(), 1u);
}

TEST(PooledAnchors, ViewsWithoutAMapTakeNoPart) {
  const OnePointScene scene;
  InferenceInput input = scene.Input();
  input.sources.insert(input.sources.begin(), input.sources[0]);
  input.source_depths.insert(input.source_depths.begin(), nullptr);
  EXPECT_EQ(PoolAnchors(input).size(), 1u);
  input.source_depths.clear();
  EXPECT_TRUE(PoolAnchors(input).empty());
}

TEST(PooledAnchors, LieOnTheSurfaceThatTheSourceMeasured) {
  const WallScene scene;
  const std::vector<PooledAnchor> pooled = PoolAnchors(scene.Input());
  EXPECT_GT(pooled.size(), 3000u);
  for (const PooledAnchor& anchor : pooled) {
    const double truth = WallInverseDepth(scene.reference.camera, anchor.x + 0.5, anchor.y + 0.5);
    ASSERT_NEAR(anchor.inverse_depth / truth, 1, 2e-6) << anchor.x << ", " << anchor.y;
  }
}

TEST(PooledAnchors, CarryAPlaneThatOneViewDeterminesPoorly) {
  const WallScene scene;
  EXPECT_GT(scene.ErrorInTheFarCorner(scene.Planes({}).At(10, 10)[0]), 0.02);
  const std::vector<PooledAnchor> pooled = PoolAnchors(scene.Input());
  const RegionPlane plane = scene.Planes(pooled).At(10, 10)[0];
  EXPECT_LT(scene.ErrorInTheFarCorner(plane), 0.001);
  // Its box ends where the source's view of the wall does, and not near the corner.
  EXPECT_GT(plane.At(150, 110), 0);
}

TEST(PooledAnchors, AloneGiveTheirPlaneExactly) {
  WallScene scene;
  *scene.measured = PlaneMap(160, 120);
  const std::vector<PooledAnchor> pooled = PoolAnchors(scene.Input());
  EXPECT_LT(scene.ErrorInTheFarCorner(scene.Planes(pooled).At(10, 10)[0]), 2e-6);
}

TEST(PooledAnchors, AreTheSameForAnyNumberOfThreads) {
  const WallScene scene;
  // Twice the same view: each of its points is there twice.
  InferenceInput input = scene.Input();
  input.sources.push_back(input.sources[0]);
  input.source_depths.push_back(input.source_depths[0]);
  std::vector<PooledAnchor> pooled[2];
  RegionPlane planes[2];
  for (const int i : {0, 1}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, i == 0 ? 1 : 3);
    pooled[i] = PoolAnchors(input);
    planes[i] = scene.Planes(pooled[i]).At(80, 60)[0];
  }
  ASSERT_FALSE(pooled[0].empty());
  EXPECT_TRUE(pooled[0] == pooled[1]);
  EXPECT_EQ(std::memcmp(&planes[0], &planes[1], sizeof(RegionPlane)), 0);
  // Nor does their order matter.
  std::reverse(pooled[1].begin(), pooled[1].end());
  const RegionPlane reversed = scene.Planes(pooled[1]).At(80, 60)[0];
  EXPECT_EQ(std::memcmp(&planes[0], &reversed, sizeof(RegionPlane)), 0);
}

TEST(PooledAnchors, LargeViewsAreSampledMoreSparsely) {
  const auto num_pooled = [](int scale) {
    const SceneView reference = CenteredView(1, 210, 140, 200),
                    source = CenteredView(2, 210 * scale, 140 * scale, 200 * scale);
    InferenceInput input;
    input.reference = {&reference, std::make_shared<GrayImage>(210, 140, std::uint8_t{128})};
    input.sources = {{&source, std::make_shared<GrayImage>(210 * scale, 140 * scale, std::uint8_t{128})}};
    input.measured = std::make_shared<const MeasurementMap>(AllMeasured(PlaneMap(210, 140)));
    input.source_depths = {
        std::make_shared<const MeasuredDepths>(AllMeasured(DepthMap(210 * scale, 140 * scale, 2.0f)))};
    return static_cast<std::int64_t>(PoolAnchors(input).size());
  };
  EXPECT_EQ(num_pooled(1), 105 * 70);
  EXPECT_EQ(num_pooled(5), 525 * 350);   // 1050 x 700, every second
  EXPECT_EQ(num_pooled(10), 525 * 350);  // 2100 x 1400, every fourth: every third would be 700 x 467
  EXPECT_LE(num_pooled(9), kMaxPooledPerView);
}

TEST(PooledAnchors, FillWhatOneViewCouldNot) {
  const WallScene scene;
  InferenceInput input = scene.Input();
  const InferenceResult together = InferPlanes(input, StereoOptions(), {});
  input.source_depths.clear();
  const InferenceResult alone = InferPlanes(input, StereoOptions(), {});
  int num_alone = 0;
  for (int y = 40; y < 100; ++y) {
    for (int x = 60; x < 140; ++x) {
      const double truth = 1 / WallInverseDepth(scene.reference.camera, x + 0.5, y + 0.5);
      ASSERT_EQ(together.map.states(x, y), PixelState::kInferredConfirmed) << x << ", " << y;
      ASSERT_NEAR(together.map.planes(x, y).depth / truth, 1, 0.001) << x << ", " << y;
      num_alone += IsInferred(alone.map.states(x, y));
    }
  }
  EXPECT_EQ(num_alone, 0);
  // The paper's formulas know scanlines only.
  InferenceOptions paper;
  paper.method.formulas = Formulas::kPaper;
  const InferenceResult paper_alone = InferPlanes(input, StereoOptions(), paper);
  const InferenceResult paper_together = InferPlanes(scene.Input(), StereoOptions(), paper);
  for (std::size_t i = 0; i < alone.map.size(); ++i) {
    ASSERT_EQ(paper_alone.map.planes.data()[i].depth, paper_together.map.planes.data()[i].depth);
  }
}

}  // namespace
}  // namespace phi

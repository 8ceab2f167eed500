#include "phi/inference/anchor_visibility.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "phi/inference/infer.h"
#include "tests/support/centered_view.h"

namespace phi {
namespace {

using test_support::CenteredView;

// A white plate of 80 x 80 cm, 2 m before the reference camera, and a white wall a metre behind it. The plate covers the
// columns 80 +- 150 * 0.4 / 2 = 50 to 109 of the reference, and the rows 30 to 89. The source stands 1.5 m to the right: of
// the wall behind the plate (x within 0.6 m) it sees what lies right of 1.5 - 3 / 2 * 1.1 = -0.15 m, which would be at column
// 80 + 150 * -0.15 / 3 = 72.5 of the reference and right of it.
struct PlateBeforeAWall {
  SceneView reference = CenteredView(1, 160, 120, 150), source = CenteredView(2, 320, 240, 240),
            beside = CenteredView(3, 320, 240, 240);
  std::shared_ptr<GrayImage> reference_image = std::make_shared<GrayImage>(160, 120, std::uint8_t{200});
  std::shared_ptr<GrayImage> source_image = std::make_shared<GrayImage>(320, 240, std::uint8_t{200});
  std::shared_ptr<PlaneMap> measured = std::make_shared<PlaneMap>(160, 120);
  std::shared_ptr<DepthMap> source_depths = std::make_shared<DepthMap>(320, 240), plate_depths;

  PlateBeforeAWall() {
    source.camera.pose.translation = {-1.5, 0, 0};
    // From x = 1.5 the plate covers the wall's x from 1.5 - 1.5 * 1.9 = -1.35 to -0.15.
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        const double wall_x = 1.5 + 3 * (x + 0.5 - 160) / 240, wall_y = 3 * (y + 0.5 - 120) / 240;
        const bool is_covered = wall_x > -1.35 && wall_x < -0.15 && std::abs(wall_y) < 0.6;
        (*source_depths)(x, y) = is_covered ? 0.0f : 3.0f;
      }
    }
  }

  static bool OnPlate(int x, int y) { return x >= 50 && x < 110 && y >= 30 && y < 90; }

  // The reference measures the outermost five pixels of the plate.
  void MeasureRim(float depth) {
    for (int y = 30; y < 90; ++y) {
      for (int x = 50; x < 110; ++x) {
        if (x < 55 || x >= 105 || y < 35 || y >= 85) (*measured)(x, y) = {{0, 0, -1}, depth};
      }
    }
  }

  InferenceInput Input() const {
    InferenceInput input;
    input.reference = {&reference, reference_image};
    input.sources = {{&source, source_image}};
    input.measured = std::make_shared<const MeasurementMap>(AllMeasured(*measured));
    input.source_depths = {std::make_shared<const MeasuredDepths>(AllMeasured(*source_depths))};
    if (plate_depths != nullptr) {
      input.sources.push_back({&beside, source_image});
      input.source_depths.push_back(std::make_shared<const MeasuredDepths>(AllMeasured(*plate_depths)));
    }
    return input;
  }

  // Another source, 20 cm to the left of the reference, measures the plate and nothing else.
  void MeasurePlateFromBeside() {
    beside.camera.pose.translation = {0.2, 0, 0};
    plate_depths = std::make_shared<DepthMap>(320, 240);
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        const double plate_x = -0.2 + 2 * (x + 0.5 - 160) / 240, plate_y = 2 * (y + 0.5 - 120) / 240;
        if (std::abs(plate_x) < 0.4 && std::abs(plate_y) < 0.4) (*plate_depths)(x, y) = 2;
      }
    }
  }

  struct Counts {
    int wall_on_plate = 0, wall_beside = 0, wall_next_to_plate = 0, plate = 0;
  };

  Counts Count(const Rules& rules = {}) const {
    Counts counts;
    for (const PooledAnchor& p : PoolAnchors(Input(), rules)) {
      const bool on_plate = OnPlate(p.PixelX(), p.PixelY());
      if (p.inverse_depth > 0.4f) {
        ++counts.plate;
      } else {
        counts.wall_on_plate += on_plate;
        counts.wall_beside += !on_plate;
        counts.wall_next_to_plate += p.PixelX() == 110 && p.PixelY() >= 30 && p.PixelY() < 90;
      }
    }
    return counts;
  }
};

TEST(AnchorVisibility, TheWallBehindIsNoAnchorOfWhatTheReferenceMeasuredAround) {
  PlateBeforeAWall scene;
  EXPECT_GT(scene.Count().wall_on_plate, 400);  // nothing tells
  const int beside = scene.Count().wall_beside;
  scene.MeasureRim(2);
  EXPECT_EQ(scene.Count().wall_on_plate, 0);
  EXPECT_EQ(scene.Count().wall_beside, beside);
  EXPECT_GT(scene.Count().wall_next_to_plate, 15);
  Rules rules;
  rules.Set(Rule::kHiddenAnchors, 0);
  EXPECT_GT(scene.Count(rules).wall_on_plate, 300);
  // Were the rim on the wall, nothing would hide it.
  scene.MeasureRim(3);
  EXPECT_GT(scene.Count().wall_on_plate, 300);
}

TEST(AnchorVisibility, TheWallBehindIsNoAnchorOfWhatAnotherViewMeasured) {
  PlateBeforeAWall scene;
  const int beside = scene.Count().wall_beside;
  EXPECT_GT(scene.Count().wall_on_plate, 400);
  scene.MeasurePlateFromBeside();
  const PlateBeforeAWall::Counts counts = scene.Count();
  EXPECT_LT(counts.wall_on_plate, 12);  // in the corners' cells the plate has fewer than three points
  EXPECT_EQ(counts.plate, 48 * 48);     // 96 pixels of the source on a side, every second
  // What shares a cell of 4 x 4 pixels with the plate's border goes too: the columns 110 and 111, the rows 28, 29, 90 and 91.
  EXPECT_LT(beside - counts.wall_beside, 2 * 60 + 4 * 40);
}

// Two points nearer than the rest are mistakes, a third one hides what lies behind.
TEST(AnchorVisibility, OneOrTwoPointsHideNothing) {
  for (const int num_before : {1, 2, 3}) {
    std::vector<PooledAnchor> pooled;
    for (int i = 0; i < 8; ++i) {
      pooled.push_back({10.0f + i % 4, 10, i < num_before ? 0.5f : 0.4f, static_cast<std::uint32_t>(i)});
    }
    RemoveHidden(40, 40, 4, &pooled);
    EXPECT_EQ(pooled.size(), num_before < 3 ? 8u : 3u) << num_before;
  }
}

// A floor seen at a grazing angle: depth grows by 1 % a row, 7 % within a cell, without a gap.
TEST(AnchorVisibility, ASlantedSurfaceDoesNotHideItself) {
  std::vector<PooledAnchor> pooled;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      pooled.push_back({1.0f * x, 1.0f * y, std::pow(0.99f, 40.0f - y), 0});
    }
  }
  RemoveHidden(40, 40, 4, &pooled);
  EXPECT_EQ(pooled.size(), 1600u);
}

// The corner of a room, 4 m away, each wall measured but for 20 pixels beside the corner. Nearer all around, the walls hide
// nothing: continued past the corner they run behind what is seen there.
TEST(AnchorVisibility, ACornerIsNotHiddenByItsWalls) {
  PlateBeforeAWall scene;
  // The walls n . X = -4 / sqrt(2) with n = (+-1, 0, -1) / sqrt(2) meet at x = 0, z = 4.
  const auto inverse_depth = [&](int x) { return (1 + std::abs((x + 0.5f - 80) / 150)) / 4; };
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      if (std::abs(x + 0.5f - 80) < 20 && y >= 40 && y < 80) continue;
      (*scene.measured)(x, y) = {{x < 80 ? 0.7071068f : -0.7071068f, 0, -0.7071068f}, 1 / inverse_depth(x)};
    }
  }
  InferenceInput input = scene.Input();
  input.source_depths.clear();
  const Surroundings surroundings(input);
  for (int y = 40; y < 80; ++y) {
    for (int x = 60; x < 100; ++x) {
      ASSERT_FALSE(surroundings.Hide(x, y, inverse_depth(x))) << x << ", " << y;
      ASSERT_TRUE(surroundings.Hide(x, y, 0.9f * inverse_depth(80))) << x << ", " << y;
    }
  }
}

// What the reference measured 2 m away all around may be a plate or the frame of a window. The source, which looks at the wall
// along a line that passes there, knows.
TEST(AnchorVisibility, AFrameThatAnotherViewLooksThroughHidesNothing) {
  PlateBeforeAWall scene;
  scene.MeasureRim(2);
  const auto is_hidden = [&] { return Surroundings(scene.Input()).Hide(80, 60, 1 / 3.0f); };
  EXPECT_TRUE(is_hidden());
  // (80.5, 60.5) at 2 m is at (0.5 / 150 * 2 - 1.5) / 2 * 240 + 160 = -19.2 there: the view must look further left.
  scene.source.camera.pinhole.cx += 60;
  std::fill_n(scene.source_depths->data(), scene.source_depths->size(), 3.0f);
  EXPECT_FALSE(is_hidden());
  std::fill_n(scene.source_depths->data(), scene.source_depths->size(), 2.0f);
  EXPECT_TRUE(is_hidden());
}

}  // namespace
}  // namespace phi

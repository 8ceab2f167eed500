#include "colmap_ext/pipeline/given_depths.h"

#include <vector>

#include <gtest/gtest.h>

#include "tests/support/centered_view.h"

namespace colmap_ext {
namespace {

// A hundred points at depths of 1 to 100, each seen by one image.
TEST(GivenDepths, ARangeThatHoldsHardlyAPointIsToldOf) {
  const std::vector<phi::SceneView> views = {test_support::CenteredView(1, 160, 120, 150)};
  phi::SparseScene scene({views[0].camera.pinhole});
  const std::vector<phi::PointObservation> track = {{.view = 0}};
  const auto warning = [&](double min, double max) { return GivenDepthsWarning(scene, views, min, max); };
  EXPECT_EQ(warning(5, 9), "") << "no point tells";
  for (int depth = 1; depth <= 100; ++depth) scene.AddPoint({0, 0, static_cast<double>(depth)}, track);
  EXPECT_EQ(warning(1000, 2000),
            "--PatchMatchStereo.depth_min and depth_max, 1000 to 2000, hold 0.0 % of the sparse points; nine in ten lie at depths of "
            "6 to 95, in the model's unit: give a range in that unit, or leave it out");
  EXPECT_NE(warning(0.01, 2.5), "");
  EXPECT_EQ(warning(0.01, 3), "");
  EXPECT_NE(warning(98.5, 200), "");
  EXPECT_EQ(warning(98, 200), "");
  EXPECT_EQ(warning(-1, -1), "") << "not given";
}

}  // namespace
}  // namespace colmap_ext

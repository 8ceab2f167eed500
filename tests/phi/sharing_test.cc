#include "phi/matching/share_pixel.h"

#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "phi/cpu/cpu_sharing.h"
#include "tests/support/centered_view.h"
#include "tests/support/exact_scenes.h"

namespace phi {
namespace {

using test_support::CenteredView;
using test_support::InputOf;
using test_support::RenderedScene;

constexpr float kOwnDepth = 3;
const Vec3f kFacing{0, 0, -1};

std::shared_ptr<const MeasurementMap> AsMap(PlaneMap planes) {
  return std::make_shared<const MeasurementMap>(MeasurementMap{std::move(planes), {}});
}

// A reference of 40 x 30 pixels, f = 40, centre (20, 15), whose own planes face it at one depth, and sources 1, 2, ... world units to its
// right that look the same way.
struct Row {
  SceneView reference = CenteredView(1, 40, 30, 40);
  std::vector<SceneView> views;
  std::vector<PlaneMap> maps;
  PlaneMap own{40, 30, {kFacing, kOwnDepth}};
  float nearest = 1, farthest = 20;

  explicit Row(int num_sources) {
    for (int i = 0; i < num_sources; ++i) {
      views.push_back(CenteredView(static_cast<std::uint32_t>(2 + i), 40, 30, 40));
      views.back().camera.pose.translation = {-1.0 - i, 0, 0};
      maps.emplace_back(40, 30);
    }
  }

  // Gives source i a plane at the pixel on which reference pixel (x, y) falls at this depth: its shift is 40 (i + 1) / depth.
  void Plant(int i, int x, int y, float depth) {
    maps[i](x - static_cast<int>(40 * (i + 1) / depth), y) = {kFacing, depth};
  }

  std::vector<SourceMap> Sources() const {
    std::vector<SourceMap> sources;
    for (std::size_t i = 0; i < views.size(); ++i)
      sources.push_back({&views[i], [map = AsMap(maps[i])] { return map; }});
    return sources;
  }

  PlaneMap Offered() const {
    EstimationParameters parameters;
    parameters.reference = MakeRayModel(reference.camera.pinhole);
    parameters.nearest = nearest;
    parameters.farthest = farthest;
    return OfferedPlanes(parameters, {&reference, AsMap(own)}, Sources());
  }
};

int CountOffers(const PlaneMap& offered) {
  int count = 0;
  for (std::size_t i = 0; i < offered.size(); ++i) count += offered.data()[i].depth > 0;
  return count;
}

TEST(OfferedPlanes, FallOnThePixelAndMeetItsCentre) {
  Row row(1);
  // The centre (10.5, 7.5) at depth 4.1 is the point (0.02625, -0.76875, 4.1) of the reference, which falls on (20.256, 7.5). The ray
  // through (20.5, 7.5) is (0.0125, -0.1875, 1); n . X = -3.26425, n . ray = -0.7925.
  row.maps[0](10, 7) = {{0.6f, 0, -0.8f}, 4.1f};
  const PlaneMap offered = row.Offered();
  EXPECT_EQ(CountOffers(offered), 1);
  EXPECT_NEAR(offered(20, 7).depth, 3.26425 / 0.7925, 1e-5);
  EXPECT_NEAR(offered(20, 7).normal.x, 0.6, 1e-6);
}

// A centre at (10.5, v) falls on u = 10.5 + 40 / depth: a hundredth of a pixel before and behind a pixel's border.
TEST(OfferedPlanes, KnowHalfAPixel) {
  Row row(1);
  row.maps[0](10, 7) = {kFacing, 40 / 10.49f};  // u = 20.99
  row.maps[0](10, 9) = {kFacing, 40 / 10.51f};  // 21.01
  const PlaneMap offered = row.Offered();
  EXPECT_GT(offered(20, 7).depth, 0);
  EXPECT_GT(offered(21, 9).depth, 0);
  EXPECT_EQ(CountOffers(offered), 2);
}

TEST(OfferedPlanes, AreTurnedIntoTheReferencesFrame) {
  Row row(1);
  // The source looks along world -x from (4, 0, 4): its z is -x, its x is z.
  row.views[0].camera.pose.rotation << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  row.views[0].camera.pose.translation = -row.views[0].camera.pose.rotation * Eigen::Vector3d(4, 0, 4);
  // Its centre (20.5, 15.5) at depth 3.9: X' = (0.04875, 0.04875, 3.9), X = (0.1, 0.04875, 4.04875), on (20.988, 15.48).
  const float c = 0.6f, s = 0.8f;
  row.maps[0](20, 15) = {{-s, 0, -c}, 3.9f};  // R^T n = (c, 0, -s)
  const PlaneMap offered = row.Offered();
  EXPECT_EQ(CountOffers(offered), 1);
  EXPECT_NEAR(offered(20, 15).normal.x, c, 1e-6);
  EXPECT_NEAR(offered(20, 15).normal.z, -s, 1e-6);
  EXPECT_NEAR(offered(20, 15).depth, (0.1 * c - 4.04875 * s) / (0.0125 * c - s), 1e-4);
}

TEST(OfferedPlanes, TheNearestOfASourceHidesTheOthers) {
  Row row(1);
  row.Plant(0, 30, 7, 4);
  row.Plant(0, 30, 7, 8);
  EXPECT_FLOAT_EQ(row.Offered()(30, 7).depth, 4);
}

TEST(OfferedPlanes, MostSourcesDecideAndTheFirstOnTies) {
  Row row(3);
  row.Plant(0, 35, 3, 8);
  row.Plant(1, 35, 3, 5);
  EXPECT_FLOAT_EQ(row.Offered()(35, 3).depth, 8);
  row.Plant(2, 35, 3, 5);
  EXPECT_FLOAT_EQ(row.Offered()(35, 3).depth, 5);
}

TEST(OfferedPlanes, AreNoneWhereASourceConfirmsThePixel) {
  for (const bool confirmed_first : {true, false}) {
    Row row(2);
    row.own(35, 3).depth = 8.03f;  // within half a percent of 8
    row.Plant(confirmed_first ? 0 : 1, 35, 3, 8);
    row.Plant(confirmed_first ? 1 : 0, 35, 3, 5);
    EXPECT_EQ(CountOffers(row.Offered()), 0);
    row.own(35, 3).depth = 8.05f;
    EXPECT_EQ(CountOffers(row.Offered()), 1);
  }
}

TEST(OfferedPlanes, AreNoneWhereThePixelHasNoDepthOrTheDepthIsOutOfRange) {
  Row row(1);
  row.Plant(0, 35, 3, 8);
  EXPECT_EQ(CountOffers(row.Offered()), 1);
  row.farthest = 7.9f;
  EXPECT_EQ(CountOffers(row.Offered()), 0);
  row.farthest = 20;
  row.own(35, 3) = {};
  EXPECT_EQ(CountOffers(row.Offered()), 0);
}

// Many planes of a source fall on one pixel: which of them stays must not depend on who comes first.
TEST(OfferedPlanes, AreTheSameForAnyNumberOfThreads) {
  Row row(2);
  for (PlaneMap& map : row.maps) {
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 40; ++x)
        map(x, y) = {kFacing, 2 + 0.37f * static_cast<float>((7 * x + 3 * y) % 11)};
    }
  }
  const PlaneMap all = row.Offered();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const PlaneMap one = row.Offered();
  for (std::size_t i = 0; i < all.size(); ++i) ASSERT_EQ(all.data()[i].depth, one.data()[i].depth) << i;
  EXPECT_GT(CountOffers(all), 300);
}

// Says what a plane costs by its depth.
struct DepthCosts {
  struct Patch {};
  float offered_cost;

  Patch LoadPatch(int, int) const { return {}; }
  float Cost(Patch, int, int, const PlaneHypothesis& h, Samples) const { return h.depth == kOwnDepth ? 0.3f : offered_cost; }
};

TEST(ChoosePlane, TakesWhatClearlyMatchesBetter) {
  Row row(1);
  row.Plant(0, 35, 3, 8);
  for (const auto& [cost, depth] : {std::pair(0.26f, 8.0f), {0.28f, kOwnDepth}, {0.5f, kOwnDepth}}) {
    PlaneMap planes = row.Offered();
    const OffersView offers{row.own.view(), planes.view(), {}};
    for (const int x : {34, 35}) ChoosePlane(DepthCosts{cost}, offers, x, 3);
    EXPECT_FLOAT_EQ(planes(35, 3).depth, depth) << cost;
    EXPECT_FLOAT_EQ(planes(34, 3).depth, kOwnDepth);
  }
}

// A patch that the search missed, in sources that did not miss it.
TEST(ShareOnCpu, MendsWhatOneSearchMissed) {
  const RenderedScene scene = test_support::PlaneScene();
  PlaneMap missed = *scene.truth[0];
  for (int y = 40; y < 80; ++y) {
    for (int x = 60; x < 100; ++x) missed(x, y).depth *= 1.1f;
  }
  const PlaneMap shared =
      ShareOnCpu({InputOf(scene), {&scene.views[0], AsMap(missed)}, scene.SourceTruth(0)}, StereoOptions());
  int num_right = 0;
  for (int y = 40; y < 80; ++y) {
    for (int x = 60; x < 100; ++x)
      num_right += std::abs(shared(x, y).depth / (*scene.truth[0])(x, y).depth - 1) < 0.002f;
  }
  EXPECT_GT(num_right, 0.97 * 40 * 40);
}

}  // namespace
}  // namespace phi

// What the estimation does in the paper's form beside the cost: draws and ranges.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "phi/backend.h"
#include "phi/inference/upsample.h"
#include "phi/matching/estimate_pixel.h"
#include "phi/matching/estimation_setup.h"
#include "phi/matching/first_hypothesis.h"
#include "tests/support/exact_scenes.h"

namespace phi {
namespace {

constexpr int kWidth = 64, kHeight = 32;
constexpr float kStartDepth = 2;

// One view, in which a plane matches the better the farther away it is.
struct FarIsBetter {
  using Patch = int;
  struct Ranked {};

  EstimationParameters parameters;
  EstimationState state;

  bool BestInSector(int x, int y, int sector, PixelOffset* best) const { return phi::BestInSector(state.cost, x, y, sector, best); }
  int LoadPatch(int, int) const { return 0; }
  float Cost(int, int, int, const PlaneHypothesis& h, Samples) const { return 1 - h.depth / 1000; }
  float Rank(int patch, int x, int y, const PlaneHypothesis& h, Ranked*) const { return Cost(patch, x, y, h, Samples::kSparse); }
  float Score(int patch, int x, int y, const PlaneHypothesis& h, Ranked*) const { return Cost(patch, x, y, h, Samples::kAll); }
};

// One iteration over planes that all face the camera at kStartDepth, without any range of the view. The sparse points' depths
// end at 4 in the left half and at 40 in the right one; none are near in the lower half.
PlaneMap UpdateOnce(Formulas formulas) {
  PlaneMap planes(kWidth, kHeight);
  CostMap cost(kWidth, kHeight);
  Array2D<std::uint8_t> changed(kWidth, kHeight);
  Array2D<DepthRange> cells(kWidth / kDepthRangeCell, kHeight / kDepthRangeCell);
  for (int y = 0; y < cells.height() / 2; ++y) {
    for (int x = 0; x < cells.width(); ++x) cells(x, y) = {1, x < cells.width() / 2 ? 4.0f : 40.0f};
  }
  FarIsBetter context;
  context.parameters.reference = MakeRayModel({kWidth, kHeight, 60, 60, kWidth / 2, kHeight / 2});
  context.parameters.depth_min = 1;
  context.parameters.depth_max = 12;
  context.parameters.nearest = 0.1f;
  context.parameters.farthest = 1000;
  context.parameters.num_views = 1;
  context.parameters.method.formulas = formulas;
  const Array2D<DepthRange>& read_only = cells;
  context.state = {planes.view(), cost.view(), changed.view(), {read_only.view()}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) InitializePixelState(context, x, y, {{0, 0, -1}, kStartDepth});
  }
  for (int y = 0; y < kHeight; ++y) {
    for (int x = y & 1; x < kWidth; x += 2) UpdatePixel(context, x, y, 0);
  }
  return planes;
}

float LargestStep(const PlaneMap& planes, int x_begin, int x_end, int y_begin, int y_end) {
  float largest = 0;
  for (int y = y_begin; y < y_end; ++y) {
    for (int x = x_begin; x < x_end; ++x) largest = std::max(largest, planes(x, y).depth - kStartDepth);
  }
  return largest;
}

// Of some 250 uniform draws in [-r, r] one is above 0.9 r.
void ExpectDraws(float largest, float range) {
  EXPECT_LE(largest, range * 1.0001f);
  EXPECT_GT(largest, 0.9f * range);
}

TEST(PaperRefinement, DepthMovesByAQuarterOfTheFarthestOfThePixelsSparsePoints) {
  const PlaneMap planes = UpdateOnce(Formulas::kPaper);
  ExpectDraws(LargestStep(planes, 0, kWidth / 2, 0, kHeight / 2), 4.0f / 4);
  ExpectDraws(LargestStep(planes, kWidth / 2, kWidth, 0, kHeight / 2), 40.0f / 4);
  ExpectDraws(LargestStep(planes, 0, kWidth, kHeight / 2, kHeight),
              12.0f / 4);  // no points: the view's range
}

// Nothing but the user bounds the paper's depths: a sparse point beyond the view's range counts whole.
TEST(PaperRange, OnlyTheUserBoundsDepths) {
  const test_support::RenderedScene scene = test_support::PlaneScene({.width = 40, .height = 30});
  EstimationInput input = test_support::InputOf(scene);
  StereoOptions options;
  const auto farthest_start = [&] {
    const EstimationParameters p = MakeEstimationParameters(input, options);
    float farthest = 0;
    for (int x = 0; x < 40; ++x) farthest = std::max(farthest, DrawHypothesis(p, {5, 50}, x, 3).depth);
    return farthest;
  };
  EXPECT_LE(farthest_start(), 10);
  options.method.formulas = Formulas::kPaper;
  EXPECT_GT(farthest_start(), 40);
  EXPECT_TRUE(MakeEstimationParameters(input, options).IsInRange(1e6f));
  EXPECT_FALSE(MakeEstimationParameters(input, options).IsInRange(0));
  input.depth_range_is_given = true;
  EXPECT_LE(farthest_start(), 10);
}

TEST(PaperWindow, OneLevelIsOneWindow) {
  const test_support::RenderedScene scene = test_support::PlaneScene();
  EstimationInput input = test_support::InputOf(scene);
  StereoOptions options;
  options.method.formulas = Formulas::kPaper;
  options.num_window_levels = 1;
  const EstimationParameters p = MakeEstimationParameters(input, options);
  EXPECT_EQ(p.num_levels, 1);
  EXPECT_EQ(p.window.narrow_step, 0);
  EXPECT_EQ(p.window.weight_decay, 0);
}

// Depth 2 between hypotheses at 1.5 and 2.6: nearer in depth is 1.5, in inverse depth (0.667, 0.5, 0.385) it is 2.6.
TEST(PaperUpsampling, TheNearestHypothesisIsNearestInDepth) {
  Array2D<float> near(1, 1, 1 / 1.5f), far(1, 1, 1 / 2.6f), none(1, 1, 0.0f);
  HypothesisMaps maps;
  maps.inverse_depth[0] = near.view();
  maps.inverse_depth[1] = far.view();
  maps.inverse_depth[2] = maps.inverse_depth[3] = none.view();
  EXPECT_EQ(NearestHypothesis(maps, Formulas::kPaper, 0, 0, 0.5f), 0);
  EXPECT_EQ(NearestHypothesis(maps, Formulas::kRobust, 0, 0, 0.5f), 1);
}

}  // namespace
}  // namespace phi

#include "phi/inference/infer_pixel.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "phi/geometry/camera.h"
#include "phi/inference/potential_tables.h"

namespace phi {
namespace {

constexpr int kWidth = 6, kHeight = 4;

// A view policy whose costs are given by hand; two source views that look along the reference's rays.
struct HandContext {
  struct Patch {};
  InferenceParameters parameters{.num_views = 2};
  HypothesisState state;
  std::array<Array2D<float>, kNumDirections> maps;
  Array2D<float> evidence{kWidth, kHeight};
  Array2D<std::uint8_t> from_region{kWidth, kHeight};
  std::array<float, kNumDirections> costs{};  // of both views
  MeasuredDepths depths = AllMeasured(DepthMap(kWidth, kHeight));
  RelativeView view;
  mutable int num_patches = 0;

  HandContext() {
    Camera camera;
    camera.pinhole = {kWidth, kHeight, 5, 5, 3, 2};
    parameters.reference = MakeRayModel(camera.pinhole);
    parameters.window = {.samples_per_side = 1, .step = 1};
    view = MakeRelativeView(camera, camera);
    for (int k = 0; k < kNumDirections; ++k) maps[k] = Array2D<float>(kWidth, kHeight);
    for (int k = 0; k < kNumDirections; ++k) state.maps.inverse_depth[k] = std::as_const(maps[k]).view();
    state.evidence = std::as_const(evidence).view();
    state.from_region = std::as_const(from_region).view();
  }
  void Offer(int x, int y, std::array<float, kNumDirections> inverse_depths) {
    for (int k = 0; k < kNumDirections; ++k) maps[k](x, y) = inverse_depths[k];
  }

  const RelativeView& View(int) const { return view; }
  MeasuredDepthsView Depths(int) const { return depths.view(); }
  Patch LoadPatch(int, int) const {
    ++num_patches;
    return {};
  }
  void Costs(const Patch&, int, int, int k, float* of_views) const { of_views[0] = of_views[1] = costs[k]; }
};

TEST(InferPixel, OnlyEvidenceAndClaimsOfPlanesCount) {
  EXPECT_EQ(EvidenceAt(PixelState::kMeasured, 4), 0.25f);
  EXPECT_EQ(EvidenceAt(PixelState::kClue, 4), 0);
  EXPECT_EQ(EvidenceAt(PixelState::kNone, 0), 0);
  EXPECT_EQ(AnchorAt(PixelState::kClue, 4, Formulas::kRobust), 0.25f);
  EXPECT_EQ(AnchorAt(PixelState::kClue, 4, Formulas::kPaper), 0);
  EXPECT_EQ(AnchorAt(PixelState::kMeasured, 4, Formulas::kPaper), 0.25f);
}

TEST(InferPixel, RegionPlanesTakeTheDiagonalsPlaces) {
  std::vector<Array2D<float>> maps(kNumDirections, Array2D<float>(1, 1, 0.5f));
  const ArrayView2D<float> views[kNumDirections] = {maps[0].view(), maps[1].view(), maps[2].view(),
                                                    maps[3].view()};
  EXPECT_EQ(PutRegionPlanes({0, 0.2f}, 249, 0, 0, views), 1 << kAscending);
  EXPECT_EQ(maps[kDescending](0, 0), 0.5f) << "the region has no first plane here";
  EXPECT_EQ(maps[kAscending](0, 0), 0.2f);
  EXPECT_EQ(PutRegionPlanes({0.3f, 0.2f}, 249, 0, 0, views), 1 << kAscending | 1 << kDescending);
  EXPECT_EQ(maps[kDescending](0, 0), 0.3f);
  EXPECT_EQ(maps[kHorizontal](0, 0), 0.5f);
  EXPECT_EQ(PutRegionPlanes({0.3f, 0.2f}, 250, 0, 0, views), 0) << "overexposed";
  for (const Array2D<float>& map : maps) EXPECT_EQ(map(0, 0), 0);
}

TEST(InferPixel, WhatIsOfferedIsMatched) {
  HandContext context;
  context.costs = {0.3f, 0.2f, 0.1f, 0.4f};
  context.Offer(2, 1, {1 / 2.0f, 1 / 4.0f, 0, 1 / 5.0f});
  const PixelHypotheses pixel = JudgeHypotheses(context, 2, 1);
  EXPECT_EQ(pixel.offered, 0b1011);
  EXPECT_FLOAT_EQ(pixel.cost[1], 0.2f);
  EXPECT_FLOAT_EQ(CheapestInverseDepth(context, 2, 1), 1 / 4.0f);

  context.Offer(2, 1, {0, 0, 0, 0});
  context.num_patches = 0;
  EXPECT_EQ(CheapestInverseDepth(context, 2, 1), 0);
  EXPECT_EQ(context.num_patches, 0) << "nothing is there to match";
}

TEST(InferPixel, ARegionsPlaneIsPreferred) {
  HandContext context;
  context.costs = {0.9f, 0.5f, 0.52f, 0.9f};
  context.Offer(2, 1, {0.1f, 0.2f, 0.3f, 0});
  context.from_region(2, 1) = 1 << kDescending;
  const PixelHypotheses pixel = JudgeHypotheses(context, 2, 1);
  EXPECT_EQ(pixel.offered, 0b111);
  EXPECT_FLOAT_EQ(pixel.cost[kDescending], 0.52f - 0.05f);
  EXPECT_EQ(pixel.Cheapest(), kDescending);
}

// Eq. 6 and 7 by the tables: the cost's energy, and for each neighbour with evidence that of the difference.
TEST(InferPixel, EvidenceBesideANodeIsPartOfItsEnergies) {
  HandContext context;
  const PotentialTables tables{InferenceOptions()};
  const PotentialView potentials = tables.view();
  context.costs = {0.25f, 0.5f, 0, 0};
  context.Offer(2, 0, {0.5f, 0.25f, 0, 0});
  Array2D<float> nodes(3, 2);
  nodes(0, 0) = 0.5f;   // left
  nodes(2, 0) = 0.4f;   // right
  nodes(1, 1) = 0.25f;  // below
  const FieldNode node = MakeFieldNode(context, potentials, std::as_const(nodes).view(), 1, 0);
  EXPECT_EQ(node.hypotheses.offered, 0b11);
  EXPECT_EQ(node.unlabelled, 0);
  EXPECT_EQ(node.inverse_depth[0], 0.5f);
  EXPECT_EQ(node.unary[0], UnaryEnergy(potentials, 0.25f) + tables.pairwise()[0] +
                               tables.pairwise()[kPotentialSteps / 4] + tables.pairwise()[kPotentialSteps]);
  EXPECT_EQ(node.unary[2], 0) << "no hypothesis";

  const FieldNode evidence = MakeFieldNode(context, potentials, std::as_const(nodes).view(), 0, 0);
  EXPECT_EQ(evidence.hypotheses.offered, 0);
  EXPECT_EQ(evidence.unlabelled, 0.5f);
}

TEST(InferPixel, AnInferredPixelGetsItsStateAndItsPlane) {
  HandContext context;
  context.depths = AllMeasured(DepthMap(kWidth, kHeight, 4.0f));
  context.evidence(1, 1) = 0.5f;
  constexpr float none = 0, alike = 1 / 4.0f, before = 1 / 2.0f, behind = 1 / 8.0f;
  EXPECT_EQ(StateAfterInference(context, 1, 1, none), PixelState::kMeasured);
  EXPECT_EQ(StateAfterInference(context, 2, 1, none), PixelState::kNone);
  EXPECT_EQ(StateAfterInference(context, 2, 1, alike), PixelState::kInferredConfirmed);
  EXPECT_EQ(StateAfterInference(context, 2, 1, behind), PixelState::kInferredAlone);
  EXPECT_EQ(StateAfterInference(context, 2, 1, before), PixelState::kInferredAlone);
  context.parameters.method.formulas = Formulas::kPaper;
  EXPECT_EQ(StateAfterInference(context, 2, 1, before), PixelState::kInferredConfirmed) << "the paper asks no view";

  const PlaneHypothesis measured{{0.6f, 0, -0.8f}, 2};
  const Array2D<float> all(kWidth, kHeight, 0.25f);  // a wall 4 m away, face on
  const auto plane = [&](const PlaneHypothesis& at_pixel, float inferred) {
    return ComposedPlane(context.parameters, at_pixel, inferred, all.view(), 2, 1);
  };
  EXPECT_EQ(plane(measured, 0).depth, 2);
  EXPECT_EQ(plane(measured, 0).normal.x, 0.6f);
  EXPECT_EQ(plane({}, 0).depth, 0);
  EXPECT_EQ(plane({}, 0).normal.z, 0);
  EXPECT_EQ(plane({}, 0.25f).depth, 4);
  EXPECT_NEAR(plane({}, 0.25f).normal.z, -1, 1e-6f);
}

}  // namespace
}  // namespace phi

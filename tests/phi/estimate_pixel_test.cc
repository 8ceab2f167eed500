// Which candidates a pixel tries in its turn.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "phi/backend.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {
namespace {

constexpr int kWidth = 40, kHeight = 32, kInside = 16;  // the pixel (kInside, kInside) has all of its sectors

struct World {
  PlaneMap planes{kWidth, kHeight};
  CostMap cost{kWidth, kHeight};
  Array2D<std::uint8_t> changed{kWidth, kHeight};
  Array2D<int> num_costs{kWidth, kHeight};
};

// All planes cost the same, but for those of the right depth where truth is known.
struct CountingContext {
  using Patch = int;
  struct Ranked {};

  EstimationParameters parameters;
  EstimationState state;
  World* world;
  bool knows_truth = false;

  bool BestInSector(int x, int y, int sector, PixelOffset* best) const { return phi::BestInSector(state.cost, x, y, sector, best); }
  int LoadPatch(int, int) const { return 0; }
  float Cost(int, int x, int y, const PlaneHypothesis& h, Samples) const {
    ++world->num_costs(x, y);
    return knows_truth ? std::abs(1 / h.depth - (0.4f + 0.001f * x - 0.0007f * y)) : 0.5f;
  }
  float Rank(int patch, int x, int y, const PlaneHypothesis& h, Ranked*) const { return Cost(patch, x, y, h, Samples::kSparse); }
  float Score(int patch, int x, int y, const PlaneHypothesis& h, Ranked*) const { return Cost(patch, x, y, h, Samples::kAll); }
};

CountingContext MakeContext(World* world, bool ranks) {
  CountingContext context;
  context.parameters.reference = MakeRayModel({kWidth, kHeight, 60, 60, kWidth / 2, kHeight / 2});
  context.parameters.nearest = 0.1f;
  context.parameters.farthest = 1000;
  context.parameters.depth_max = 12;
  context.parameters.inverse_depth_per_pixel = 0.001f;
  context.parameters.num_views = 1;
  context.parameters.first_iteration = 2;
  context.parameters.ranks = ranks;
  context.state = {world->planes.view(), world->cost.view(), world->changed.view()};
  context.world = world;
  return context;
}

// No two pixels of a surroundings have the same plane.
void Initialize(const CountingContext& context) {
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      InitializePixelState(context, x, y, {{0, 0, -1}, 2 + 0.01f * static_cast<float>((17 * x + 29 * y) % 101)});
    }
  }
}

void HalfPass(const CountingContext& context, int iteration, int colour) {
  context.world->num_costs = Array2D<int>(kWidth, kHeight, 0);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = (y + colour) & 1; x < kWidth; x += 2) UpdatePixel(context, x, y, iteration);
  }
}

class Turn : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Ranks, Turn, testing::Bool());

// Where nothing is better than what there is, each pixel tries its eight candidates once, in the first iteration of a part: the second
// colour too, whose candidates have had a turn by then. Afterwards refinement alone is left.
TEST_P(Turn, CandidatesThatAreSettledAreNotTriedAgain) {
  World world;
  const CountingContext context = MakeContext(&world, GetParam());
  Initialize(context);
  // All samples: eight, and three of refinement. Ranked: eight, two finalists, the plane itself and refinement's.
  const int first = GetParam() ? 8 + kNumFinalists + 1 + kNumVariants : 8 + kNumVariants;
  const int later = GetParam() ? 1 + kNumVariants : kNumVariants;
  for (int iteration = 2; iteration < 4; ++iteration) {
    for (int colour = 0; colour < 2; ++colour) {
      HalfPass(context, iteration, colour);
      EXPECT_EQ(world.num_costs(kInside + colour, kInside), iteration == 2 ? first : later) << iteration << colour;
    }
  }
}

// A pixel that found something better is a candidate of those that it is the best for, once.
TEST_P(Turn, WhatHasChangedIsACandidateAgain) {
  World world;
  const CountingContext context = MakeContext(&world, GetParam());
  Initialize(context);
  for (int iteration = 2; iteration < 4; ++iteration) {
    for (int colour = 0; colour < 2; ++colour) HalfPass(context, iteration, colour);
  }
  const PlaneHypothesis better = {{0, 0, -1}, 5};
  WriteState(context.state, kInside + 1, kInside, better, 0.25f);
  const int later = GetParam() ? 1 + kNumVariants : kNumVariants, with_one = later + (GetParam() ? 2 : 1);
  HalfPass(context, 4, 0);
  EXPECT_EQ(world.num_costs(kInside, kInside), with_one);
  EXPECT_EQ(world.num_costs(kInside + 2, kInside), with_one);
  EXPECT_EQ(world.num_costs(kInside - 6, kInside - 2), later) << "the pixel is in none of its sectors";
  HalfPass(context, 4, 1);
  HalfPass(context, 5, 0);
  EXPECT_EQ(world.num_costs(kInside, kInside), later);
}

// Scored by all samples, what is settled cannot win: the same maps as with all candidates in each turn, in fewer costs.
TEST(SettledCandidates, AreNoLoss) {
  World skips, tries_all;
  int num_costs[2] = {};
  for (World* world : {&skips, &tries_all}) {
    CountingContext context = MakeContext(world, false);
    context.knows_truth = true;
    Initialize(context);
    for (int iteration = 2; iteration < 7; ++iteration) {
      for (int colour = 0; colour < 2; ++colour) {
        if (world == &tries_all) std::fill_n(world->changed.data(), world->changed.size(), std::uint8_t{1});
        HalfPass(context, iteration, colour);
        for (std::size_t i = 0; i < world->num_costs.size(); ++i) num_costs[world == &tries_all] += world->num_costs.data()[i];
      }
    }
  }
  EXPECT_LT(num_costs[0], 0.95 * num_costs[1]);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_EQ(skips.planes(x, y).depth, tries_all.planes(x, y).depth) << x << ", " << y;
      EXPECT_EQ(skips.cost(x, y), tries_all.cost(x, y)) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace phi

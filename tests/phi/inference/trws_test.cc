#include "phi/inference/trws.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "phi/base/error.h"
#include "tests/phi/inference/field_for_tests.h"

namespace phi {
namespace {

// Bound, optimum and energy in their order, whatever the field.
void ExpectOrdered(const TrwsResult& result, std::int64_t optimum) {
  for (std::size_t i = 0; i < result.lower_bounds.size(); ++i) {
    EXPECT_LE(result.lower_bounds[i], optimum);
    if (i > 0) {
      EXPECT_GE(result.lower_bounds[i], result.lower_bounds[i - 1]) << "pass " << i;
    }
    EXPECT_GE(result.pass_energies[i], optimum);
  }
  EXPECT_GE(result.energy, optimum);
}

TEST(Potentials, AreTheNegativeLogarithmsOfEquations6And7) {
  const InferenceOptions options;
  const PotentialTables tables(options);
  // Eq. 6 with kappa1 = 4, kappa2 = 1/2: phi(C) = (2 - C) / 4 + 1/2, so phi(0) = 1, phi(1) = 3/4, phi(2) = 1/2.
  EXPECT_EQ(UnaryEnergy(tables.view(), 0.0f), 0);
  EXPECT_NEAR(UnaryEnergy(tables.view(), 1.0f), 4096 * std::log(4.0 / 3), 1);
  EXPECT_NEAR(UnaryEnergy(tables.view(), 2.0f), 4096 * std::log(2.0), 1);
  EXPECT_EQ(UnaryEnergy(tables.view(), NAN), UnaryEnergy(tables.view(), 2.0f));
  // Eq. 7 with kappa3 = 2: phi = (2 - difference)^2, relative to phi(0) = 4; the difference saturates at 1.
  EXPECT_EQ(PairwiseEnergy(tables.view(), 3.0f, 3.0f), 0);
  EXPECT_NEAR(PairwiseEnergy(tables.view(), 2.0f, 3.0f), 4096 * -2 * std::log(1.5 / 2), 1);
  EXPECT_NEAR(PairwiseEnergy(tables.view(), 10.0f, 1.0f), 4096 * 2 * std::log(2.0), 1);
  // Relative differences of depths and of inverse depths are the same number.
  EXPECT_EQ(PairwiseEnergy(tables.view(), 2.0f, 3.0f), PairwiseEnergy(tables.view(), 1 / 2.0f, 1 / 3.0f));
}

TEST(Potentials, TruncationIsAnOption) {
  InferenceOptions options;
  options.truncation = 0.1;
  const PotentialTables tables(options);
  EXPECT_NEAR(PairwiseEnergy(tables.view(), 1.0f, 5.0f), 4096 * -2 * std::log(1.9 / 2), 1);
}

// The most that a difference may cost is 15 nats: kappa3 = truncation / (1 - exp(-7.5)).
TEST(Potentials, FitSixteenBits) {
  InferenceOptions options;
  options.truncation = 0.5;
  const double least = options.truncation / (1 - std::exp(-7.5));
  options.kappa3 = least * (1 + 1e-9);
  EXPECT_EQ(options.Check(), "");
  EXPECT_LT(PairwiseEnergy(PotentialTables(options).view(), 1.0f, 5.0f), 1 << 16);
  options.kappa3 = least * (1 - 1e-6);
  EXPECT_NE(options.Check().find("more than the truncation"), std::string::npos);
  EXPECT_THROW(PotentialTables{options}, UsageError);
  options.kappa3 = 0.4;
  EXPECT_NE(options.Check(), "");
}

TEST(Trws, ChainsAreExactAfterOnePass) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const bool row : {true, false}) {
      const FieldForTests field(row ? 30 : 1, row ? 1 : 30, seed);
      const TrwsResult result = SolveTrws(field.view(), 1);
      if (!row) {
        EXPECT_EQ(result.energy, RowProgrammingOptimum(field.view()));
      }
      EXPECT_EQ(result.energy, result.lower_bounds.back());  // the bound proves the optimum
    }
  }
}

TEST(Trws, TreesAreExact) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    FieldForTests comb(5, 6, seed);  // a spine along the top, teeth in every second column
    for (int y = 1; y < 6; ++y) comb.allowed[y * 5 + 1] = comb.allowed[y * 5 + 3] = 0;
    const TrwsResult result = SolveTrws(comb.view(), 100);
    ExpectOrdered(result, RowProgrammingOptimum(comb.view()));
    EXPECT_EQ(result.energy, RowProgrammingOptimum(comb.view())) << "seed " << seed;
  }
}

TEST(Trws, SmallGridsLieBetweenBoundAndBruteForce) {
  int met = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (int height = 1; height <= 4; ++height) {
      FieldForTests field(2, height, seed);
      if (seed % 2) field.allowed[seed % (2 * height)] = 5;  // forbidden labels 1 and 3
      const std::int64_t optimum = BruteForceOptimum(field.view());
      EXPECT_EQ(optimum, RowProgrammingOptimum(field.view()));  // the two references agree
      const TrwsResult result = SolveTrws(field.view(), 50);
      ExpectOrdered(result, optimum);
      if (result.energy == result.lower_bounds.back()) {
        ++met;
        EXPECT_EQ(result.energy, optimum);
      }
    }
  }
  EXPECT_GT(met, 20);  // else the statement above is empty
}

TEST(Trws, FourByFourGridsLieBetweenBoundAndRowProgram) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    FieldForTests field(4, 4, 100 + seed);
    if (seed >= 4) field.allowed[5] = 0, field.allowed[10] = 2;  // a hole in the field, a single label
    const std::int64_t optimum = RowProgrammingOptimum(field.view());
    const TrwsResult result = SolveTrws(field.view(), 50);
    ExpectOrdered(result, optimum);
    if (result.energy == result.lower_bounds.back()) {
      EXPECT_EQ(result.energy, optimum);
    }
  }
}

// Two slanted surfaces, four noisy hypotheses of which one or two are right, costs that hardly tell them apart: what
// plain walls give.
FieldForTests MakePlainWalls(int width, int height, unsigned seed) {
  FieldForTests field(width, height, seed);
  std::mt19937 random(seed);
  std::normal_distribution<float> noise;
  std::uniform_real_distribution<float> uniform;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t node = static_cast<std::size_t>(y) * width + x;
      const float truth = x + y / 2 < width / 2 ? 0.3f + 0.001f * x : 0.5f - 0.001f * y;
      field.allowed[node] = static_cast<std::uint8_t>(random() % 16);
      for (int k = 0; k < kMaxLabels; ++k) {
        const bool wrong = uniform(random) < 0.4f;
        const float w = truth * (1 + 0.003f * noise(random) + (wrong ? 0.1f * noise(random) : 0.0f));
        field.inverse_depth[kMaxLabels * node + k] = std::max(w, 0.05f);
        const float cost = 0.5f + (wrong ? 0.1f : 0.0f) + 0.2f * uniform(random);
        field.unary[kMaxLabels * node + k] = UnaryEnergy(field.view().potentials, cost);
      }
    }
  }
  return field;
}

TEST(Trws, FiftyPassesReachTheBetterOfBeliefPropagationAndIndependentMinima) {
  const FieldForTests field = MakePlainWalls(120, 90, 7);
  const TrwsResult result = SolveTrws(field.view(), 50);
  const std::int64_t independent = FieldEnergy(field.view(), MinUnaryLabels(field.view()));
  const std::int64_t reference = std::min(independent, BeliefPropagationEnergy(field.view(), 50));
  EXPECT_LE(static_cast<double>(result.energy), 1.001 * static_cast<double>(reference));
  EXPECT_LT(result.energy, independent);
  for (std::size_t i = 1; i < result.lower_bounds.size(); ++i) {
    EXPECT_GE(result.lower_bounds[i], result.lower_bounds[i - 1]);
  }
  EXPECT_LE(result.lower_bounds.back(), result.energy);
  const double gap =
      1.0 - static_cast<double>(result.lower_bounds[0]) / static_cast<double>(result.pass_energies[0]);
  RecordProperty("gap_after_one_pass_percent", std::to_string(100 * gap));
}

TEST(Trws, LabelsAreTheSameForAnyNumberOfThreads) {
  const FieldForTests field = MakePlainWalls(300, 210, 3);  // several tiles each way
  TrwsResult results[3];
  const int threads[3] = {1, 2, 7};
  for (int i = 0; i < 3; ++i) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads[i]);
    tbb::task_arena arena(threads[i]);
    arena.execute([&] { results[i] = SolveTrws(field.view(), 3); });
  }
  for (int i = 1; i < 3; ++i) {
    EXPECT_EQ(results[i].labels, results[0].labels);
    EXPECT_EQ(results[i].lower_bounds, results[0].lower_bounds);
    EXPECT_EQ(results[i].pass_energies, results[0].pass_energies);
  }
}

TEST(Trws, WavefrontsGiveThePlainRasterOrdersLabels) {
  const FieldForTests field = MakePlainWalls(150, 140, 5);
  FieldView f = field.view();
  const std::size_t n = field.allowed.size();
  std::vector<std::int32_t> horizontal(kMaxLabels * n, 0), vertical(kMaxLabels * n, 0);
  std::vector<std::uint8_t> labels(n, kNoLabel);
  f.horizontal = horizontal.data();
  f.vertical = vertical.data();
  f.label = labels.data();
  for (int y = 0; y < f.height; ++y) {
    for (int x = 0; x < f.width; ++x) UpdateNode(f, x, y, true);
  }
  for (int y = f.height - 1; y >= 0; --y) {
    for (int x = f.width - 1; x >= 0; --x) {
      DecodeNode(f, x, y);
      UpdateNode(f, x, y, false);
    }
  }
  EXPECT_EQ(SolveTrws(field.view(), 1).labels, labels);
}

TEST(Trws, TiesGoToTheLowestAllowedLabel) {
  FieldForTests field(3, 3, 1);
  std::fill(field.inverse_depth.begin(), field.inverse_depth.end(), 0.5f);
  std::fill(field.unary.begin(), field.unary.end(), 10);
  std::fill(field.allowed.begin(), field.allowed.end(), 0b1100);
  for (const std::uint8_t label : SolveTrws(field.view(), 2).labels) EXPECT_EQ(label, 2);
}

}  // namespace
}  // namespace phi

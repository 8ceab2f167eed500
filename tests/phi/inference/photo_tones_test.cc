#include "phi/inference/photo_tones.h"

#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

namespace phi {
namespace {

constexpr double kPrior = 0.001;

// What one source and the reference show of surfaces of every brightness, seen at every place of both.
using FactorAt = std::function<float(float u, float v)>;
std::vector<SpotPair> Seen(const FactorAt& reference, const FactorAt& source, float exponent, float noise = 0) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> brightness(40, 150), place(0, 1);
  std::normal_distribution<float> error(0, 1);
  std::vector<SpotPair> pairs;
  for (int i = 0; i < 6000; ++i) {
    const float surface = brightness(random);
    SpotPair pair{{0, 0, place(random), place(random)}, {0, 0, place(random), place(random)}};
    pair.source.brightness = surface / source(pair.source.u, pair.source.v);
    pair.reference.brightness = 100 * std::pow(surface / 100, exponent) / reference(pair.reference.u, pair.reference.v);
    pair.reference.brightness *= std::exp(noise * error(random));
    pairs.push_back(pair);
  }
  return pairs;
}

SharedTones Shared(const std::vector<SpotPair>& pairs) {
  SharedTones shared{pairs, {}};
  for (const auto& [reference, source] : pairs) shared.unexplained.push_back(std::log(reference.brightness / source.brightness));
  return shared;
}

float One(float, float) { return 1; }
float BrightAbove(float, float v) { return std::exp(0.2f * std::cos(std::numbers::pi_v<float> * v)); }
float BrightInTheMiddle(float u, float) { return std::exp(-0.15f * std::cos(2 * std::numbers::pi_v<float> * u)); }

TEST(ToneField, IsTheExponentialOfCosines) {
  ToneField::Terms factors = ToneField::Terms::Zero();
  const ToneField::Terms orders = ToneField::OrderOfTerms();
  EXPECT_EQ(orders.minCoeff(), 1);
  EXPECT_EQ(orders.maxCoeff(), ToneField::kOrder);
  factors[0] = 0.3f;  // half a wave over the height
  const ToneField field(factors);
  EXPECT_NEAR(field.At(0.7f, 0), std::exp(0.3f), 1e-5);
  EXPECT_NEAR(field.At(0.2f, 0.5f), 1, 1e-5);
  EXPECT_NEAR(field.At(0.2f, 1), std::exp(-0.3f), 1e-5);
  EXPECT_NEAR(field.At(0.2f, 0.26f), std::exp(0.3f * std::cos(0.26f * std::numbers::pi_v<float>)), 1e-3);
}

TEST(PhotoTones, FindsBothFieldsAndTheExponent) {
  const std::vector<SpotPair> pairs = Seen(BrightAbove, BrightInTheMiddle, 1.2f);
  const auto tones = PhotoTones::Fit(std::vector{Shared(pairs)}, kPrior);
  ASSERT_EQ(tones.size(), 1u);
  for (const auto& [reference, source] : pairs)
    ASSERT_NEAR(tones[0]->Factor(reference, source) * source.brightness, reference.brightness, 2);
  EXPECT_NEAR(tones[0]->Slope(), 1.2f, 0.01f);
  // Of the reference alone: above it shows the same surface darker by exp(0.4).
  EXPECT_NEAR(tones[0]->OfReference()->Factor({100, 0, 0.5f, 0}, {100, 0, 0.5f, 1}), std::exp(-0.4f), 0.02f);
}

// One source alone shows what the reference is brighter in; the other sees one row of it.
TEST(PhotoTones, AllSourcesTellOfTheReference) {
  std::vector<SpotPair> row = Seen(One, One, 1);
  for (SpotPair& pair : row) {
    pair.reference.v = 0.1f;
    pair.reference.brightness = pair.source.brightness / BrightAbove(0, 0.1f);
  }
  const std::vector<SpotPair> all = Seen(BrightAbove, One, 1);
  const auto tones = PhotoTones::Fit(std::vector{Shared(row), Shared(all)}, kPrior);
  ASSERT_EQ(tones.size(), 2u);
  const BrightSpot source{100, 0, 0.5f, 0.5f};
  EXPECT_NEAR(tones[0]->Factor({100, 0, 0.5f, 1}, source) / tones[0]->Factor({100, 0, 0.5f, 0}, source), std::exp(0.4f), 0.04f);
}

// Products of Eigen's add in another order where the processor's cache has another size.
TEST(PhotoTones, AreTheSameOnEveryProcessor) {
  const std::vector<SpotPair> pairs = Seen(BrightAbove, BrightInTheMiddle, 1.1f, 0.02f);
  std::ptrdiff_t l1 = 0, l2 = 0, l3 = 0;
  Eigen::internal::manage_caching_sizes(Eigen::GetAction, &l1, &l2, &l3);
  const auto fitted = [&](std::ptrdiff_t cache) {
    Eigen::setCpuCacheSizes(cache, l2, l3);
    return PhotoTones::Fit(std::vector{Shared(pairs)}, kPrior);
  };
  const auto large = fitted(48 << 10), small = fitted(16 << 10);
  Eigen::setCpuCacheSizes(l1, l2, l3);
  ASSERT_EQ(large.size(), 1u);
  ASSERT_EQ(small.size(), 1u);
  for (const auto& [reference, source] : pairs) ASSERT_EQ(large[0]->Factor(reference, source), small[0]->Factor(reference, source));
}

TEST(PhotoTones, MistakenSpotsDoNotMatter) {
  std::vector<SpotPair> pairs = Seen(BrightAbove, BrightInTheMiddle, 1);
  const std::vector<SpotPair> right = pairs;
  for (std::size_t i = 0; i < pairs.size(); i += 5) pairs[i].reference.brightness *= 1.8f;
  const auto tones = PhotoTones::Fit(std::vector{Shared(pairs)}, kPrior);
  ASSERT_EQ(tones.size(), 1u);
  for (const auto& [reference, source] : right)
    ASSERT_NEAR(tones[0]->Factor(reference, source) * source.brightness, reference.brightness, 4);
}

TEST(PhotoTones, WhatForetellsNothingIsNone) {
  EXPECT_TRUE(PhotoTones::Fit({}, kPrior).empty());
  EXPECT_TRUE(PhotoTones::Fit(std::vector{Shared(Seen(One, One, 1, 0.05f))}, kPrior).empty());
  EXPECT_EQ(PhotoTones::Fit(std::vector{Shared(Seen(BrightAbove, One, 1, 0.05f))}, kPrior).size(), 1u);
}

}  // namespace
}  // namespace phi

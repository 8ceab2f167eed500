#include "phi/fusion/term_functions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace phi {
namespace {

// The largest error of function(x) over [least, most], measured as error(value, x).
template <typename Function, typename Error>
double LargestError(double least, double most, const Function& function, const Error& error) {
  constexpr int kSteps = 1000000;
  double largest = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const float x = static_cast<float>(least + (most - least) * i / kSteps);
    largest = std::max(largest, std::abs(error(static_cast<double>(function(x)), static_cast<double>(x))));
  }
  return largest;
}

TEST(TermFunctions, Logarithm) {
  for (const double most : {1.0, 2.0, 1000.0}) {
    EXPECT_LT(LargestError(0.25, most, Log2, [](double value, double x) { return value - std::log2(x); }),
              1e-6);
  }
  for (int power = -20; power <= 20; ++power)
    EXPECT_EQ(Log2(std::ldexp(1.0f, power)), static_cast<float>(power));
}

TEST(TermFunctions, AngleOfACosine) {
  const auto degrees = [](double cosine) { return std::acos(cosine) * 180 / std::numbers::pi; };
  EXPECT_LT(LargestError(-1, 1, DegreesOfCosine, [&](double value, double x) { return value - degrees(x); }),
            3e-5);
  for (const double least : {-1.0, 0.99, 0.9999}) {
    EXPECT_LT(LargestError(least, 1, DegreesOfCosine,
                           [&](double value, double x) { return (value + 0.3) / (degrees(x) + 0.3) - 1; }),
              1e-6);
  }
  EXPECT_EQ(DegreesOfCosine(1), 0);
  EXPECT_EQ(DegreesOfCosine(1.0000001f), 0);
  EXPECT_FLOAT_EQ(DegreesOfCosine(-1.0000001f), 180);
}

TEST(TermFunctions, Probability) {
  const auto error = [](double value, double x) { return value - 1 / (1 + std::exp(-x)); };
  EXPECT_LT(LargestError(-20, 20, Logistic, error), 2e-7);
  EXPECT_LT(LargestError(-kMostLogOdds, kMostLogOdds, Logistic, error), 2e-7);
  EXPECT_EQ(Logistic(0), 0.5f);
}

}  // namespace
}  // namespace phi

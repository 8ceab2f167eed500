// Costs and evidence of HypothesisMatcher on a slanted plane, against sums written out here in double precision. The images
// are noise, so that half a pixel anywhere in the sampling gives another cost.
#include "phi/inference/hypothesis_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "phi/base/random.h"

namespace phi {
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr double kFx = 100, kFy = 104, kCx = 30.25, kCy = 25.5;
// Shift of a source camera: a point of inverse depth w moves by (fx tx w, fy ty w) pixels.
struct Shift {
  double x, y;  // world units, source_from_reference
};
constexpr Shift kShifts[] = {{-0.21, 0.0625}, {0.125, -0.17}};

double InverseDepthAt(double u, double v) { return 0.21 + 0.0011 * u - 0.0008 * v; }

std::shared_ptr<const GrayImage> Noise(std::uint32_t seed) {
  auto image = std::make_shared<GrayImage>(kWidth, kHeight);
  for (std::size_t i = 0; i < image->size(); ++i) {
    image->data()[i] =
        static_cast<std::uint8_t>(Philox({11, seed}, static_cast<std::uint32_t>(i), 0, 0).v[0] >> 24);
  }
  return image;
}

double Bilinear(const GrayImage& image, double u, double v) {
  const double x = std::clamp(u - 0.5, 0.0, kWidth - 1.0), y = std::clamp(v - 0.5, 0.0, kHeight - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, kWidth - 1), y1 = std::min(y0 + 1, kHeight - 1);
  const double fx = x - x0, fy = y - y0;
  return (1 - fy) * ((1 - fx) * image(x0, y0) + fx * image(x1, y0)) +
         fy * ((1 - fx) * image(x0, y1) + fx * image(x1, y1));
}

PixelHypotheses Judge(const HypothesisMatcher& matcher, int x, int y) {
  return JudgeHypotheses(HypothesisMatcher::Context(matcher), x, y);
}

class HypothesisMatcherTest : public ::testing::Test {
 protected:
  HypothesisMatcherTest() : measured_(kWidth, kHeight) {
    const Pinhole pinhole{kWidth, kHeight, kFx, kFy, kCx, kCy};
    for (SceneView& view : views_) view.camera.pinhole = pinhole;
    input_.reference = {&views_[0], Noise(0)};
    for (std::size_t j = 0; j < 2; ++j) {
      views_[j + 1].camera.pose.translation = {kShifts[j].x, kShifts[j].y, 0};
      input_.sources.push_back({&views_[j + 1], Noise(static_cast<std::uint32_t>(j + 1))});
    }
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        measured_(x, y) = {{0, 0, -1}, static_cast<float>(1 / InverseDepthAt(x + 0.5, y + 0.5))};
      }
    }
  }

  // 1 - ZNCC over 11 x 11 samples 1.4 pixels apart. A sample's inverse depth is that of the pixel that it lies in.
  double ExpectedCost(int x, int y, int source) const {
    const GrayImage &reference = *input_.reference.image,
                    &other = *input_.sources[static_cast<std::size_t>(source)].image;
    double n = 0, r = 0, rr = 0, s = 0, ss = 0, rs = 0;
    for (int row = -5; row <= 5; ++row) {
      for (int column = -5; column <= 5; ++column) {
        const double u = x + 0.5 + 1.4 * column, v = y + 0.5 + 1.4 * row;
        const double w = InverseDepthAt(std::floor(u) + 0.5, std::floor(v) + 0.5);
        const double a = Bilinear(reference, u, v);
        const double b = Bilinear(other, u + kFx * kShifts[source].x * w, v + kFy * kShifts[source].y * w);
        n += 1;
        r += a;
        rr += a * a;
        s += b;
        ss += b * b;
        rs += a * b;
      }
    }
    return 1 - (rs / n - r / n * s / n) / std::sqrt((rr / n - r / n * r / n) * (ss / n - s / n * s / n));
  }

  SceneView views_[4];  // the last one stands where the reference does
  InferenceInput input_;
  PlaneMap measured_;
};

TEST_F(HypothesisMatcherTest, CostsOfASlantedPlane) {
  const Hypotheses hypotheses(AllMeasured(measured_), Formulas::kPaper);
  const HypothesisMatcher robust(input_, hypotheses, StereoOptions(), Formulas::kRobust);
  const HypothesisMatcher paper(input_, hypotheses, StereoOptions(), Formulas::kPaper);
  for (const auto& [x, y] : {std::pair{20, 15}, {31, 24}, {40, 30}, {44, 19}}) {
    const double first = ExpectedCost(x, y, 0), second = ExpectedCost(x, y, 1);
    ASSERT_GT(std::abs(first - second), 1e-3) << "the two views tell nothing apart";
    for (const HypothesisMatcher* matcher : {&robust, &paper}) {
      const PixelHypotheses judged = Judge(*matcher, x, y);
      EXPECT_EQ(judged.offered, 15) << "a measured pixel is every direction's hypothesis";
      for (int k = 0; k < kNumDirections; ++k)
        EXPECT_NEAR(judged.cost[k], 2 / (1 / first + 1 / second), 2e-4) << x << ", " << y;
    }
  }
}

// A witness has no say in what a hypothesis costs.
TEST_F(HypothesisMatcherTest, OnlyTheFirstSourcesAreMatched) {
  input_.max_matched = 1;
  const Hypotheses hypotheses(AllMeasured(measured_), Formulas::kPaper);
  const HypothesisMatcher matcher(input_, hypotheses, StereoOptions(), Formulas::kRobust);
  for (const auto& [x, y] : {std::pair{20, 15}, {31, 24}, {40, 30}}) {
    EXPECT_NEAR(Judge(matcher, x, y).cost[0], ExpectedCost(x, y, 0), 2e-4) << x << ", " << y;
  }
}

// The window reaches 7 pixels from the centre, and the first source shows it 100 * 0.21 * w = 4 to 5 pixels further left.
TEST_F(HypothesisMatcherTest, AWindowThatLeavesTheSourceImageHasNoCost) {
  input_.sources.resize(1);
  const Hypotheses hypotheses(AllMeasured(measured_), Formulas::kPaper);
  const HypothesisMatcher matcher(input_, hypotheses, StereoOptions(), Formulas::kPaper);
  for (int x = 7; x < 20; ++x) {
    // The leftmost sample is the one of the row where the inverse depth is largest: the first.
    double leftmost = kWidth;
    for (int row = -5; row <= 5; ++row) {
      const double u = x + 0.5 - 7, v = 20.5 + 1.4 * row;
      leftmost = std::min(leftmost,
                          u + kFx * kShifts[0].x * InverseDepthAt(std::floor(u) + 0.5, std::floor(v) + 0.5));
    }
    ASSERT_GT(std::abs(leftmost - 0.5), 1e-3) << "too near the border to tell";
    EXPECT_EQ(Judge(matcher, x, 20).cost[0] == kMaxCost, leftmost < 0.5) << x << ", " << leftmost;
  }
}

// A GPU has the scalar form. Everywhere, also where a window leaves either image on any side.
TEST_F(HypothesisMatcherTest, TheScalarFormHasTheSameCosts) {
  input_.sources.push_back({&views_[3], input_.sources[0].image});
  const Hypotheses hypotheses(AllMeasured(measured_), Formulas::kPaper);
  const HypothesisMatcher matcher(input_, hypotheses, StereoOptions(), Formulas::kRobust);
  const HypothesisMatcher::Context context(matcher);
  int num_outside[3] = {};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      float costs[kMaxSourceViews];
      context.Costs(context.LoadPatch(x, y), x, y, 0, costs);
      for (int j = 0; j < 3; ++j) {
        const GraySampler source{input_.sources[static_cast<std::size_t>(j)].image->view()};
        const float scalar = HypothesisViewCost<GraySampler>(context.reference, {source, context.View(j)}, context.parameters.window,
                                                             context.state.maps.inverse_depth[0], x, y);
        ASSERT_NEAR(costs[j], scalar, 2e-4) << x << ", " << y << ", source " << j;
        num_outside[j] += scalar == kMaxCost;
      }
    }
  }
  for (const int num : num_outside) {
    EXPECT_GT(num, 500);
    EXPECT_LT(num, kWidth * kHeight - 500);
  }
}

// The first source measured one pixel only, (12, 9). Points are asked about that fall 0.1 to 0.9 pixels into it or its
// neighbours.
TEST_F(HypothesisMatcherTest, EvidenceComesFromThePixelThatThePointFallsInto) {
  input_.sources.resize(1);
  const double depth = 4;
  auto depths = std::make_shared<DepthMap>(kWidth, kHeight, 0.0f);
  (*depths)(12, 9) = static_cast<float>(depth);
  input_.source_depths = {std::make_shared<const MeasuredDepths>(AllMeasured(*depths))};
  const Hypotheses hypotheses(AllMeasured(measured_), Formulas::kPaper);
  for (const double into : {0.1, 0.4, 0.6, 0.9}) {
    // Reference pixel 20 falls to 12 + into; row 4 to 9 + into.
    views_[1].camera.pose.translation = {(12 + into - 20.5) * depth / kFx, (9 + into - 4.5) * depth / kFy, 0};
    const HypothesisMatcher matcher(input_, hypotheses, StereoOptions(), Formulas::kRobust);
    const auto w = [&](double relative) { return static_cast<float>(1 / (depth * relative)); };
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        EXPECT_EQ(IsConfirmed(HypothesisMatcher::Context(matcher), 20 + dx, 4 + dy, w(1)), dx == 0 && dy == 0)
            << into << ": " << dx << ", " << dy;
      }
    }
  }
  // At the middle of the pixel a depth may be off by 1 % either way.
  for (const auto& [relative, confirmed] : {std::pair{0.991, true}, {1.009, true}, {0.989, false}, {1.011, false}}) {
    views_[1].camera.pose.translation = {(12.5 - 20.5) * depth * relative / kFx,
                                         (9.5 - 4.5) * depth * relative / kFy, 0};
    const HypothesisMatcher matcher(input_, hypotheses, StereoOptions(), Formulas::kRobust);
    EXPECT_EQ(IsConfirmed(HypothesisMatcher::Context(matcher), 20, 4, static_cast<float>(1 / (depth * relative))), confirmed)
        << relative;
  }
}

}  // namespace
}  // namespace phi

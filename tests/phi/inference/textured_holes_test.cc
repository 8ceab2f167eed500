// Holes where the images have texture: matching chooses among the planes around them, and refuses none.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "phi/inference/infer.h"

namespace phi {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 150, kDepth = 3;

// Strong texture on the wall z = 3; x, y in metres. Smooth over several pixels of 2 cm.
double WallBrightness(double x, double y) {
  return 128 + 40 * std::sin(52 * x + 3 * std::sin(7 * y)) + 40 * std::sin(47 * y + 2 * std::sin(11 * x));
}

SceneView MakeView(const std::string& name, double baseline) {
  SceneView view;
  view.name = name;
  view.camera.pinhole = {kWidth, kHeight, kFocal, kFocal, kWidth / 2.0, kHeight / 2.0};
  view.camera.pose.translation = {-baseline, 0, 0};
  return view;
}

// `brightness(x, y)` of the ray through (x, y, 1), from the camera that stands at (baseline, 0, 0).
template <class Brightness>
std::shared_ptr<const GrayImage> Photograph(const Brightness& brightness) {
  auto image = std::make_shared<GrayImage>(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double value = brightness((x + 0.5 - kWidth / 2.0) / kFocal, (y + 0.5 - kHeight / 2.0) / kFocal);
      (*image)(x, y) = static_cast<std::uint8_t>(std::lround(value));
    }
  }
  return image;
}

std::shared_ptr<const GrayImage> TexturedWall(double baseline) {
  return Photograph([&](double x, double y) { return WallBrightness(kDepth * x + baseline, kDepth * y); });
}

bool InHole(int x, int y) { return x >= 60 && x < 100 && y >= 40 && y < 80; }

// The reference's map: the wall, but for a hole of 40 x 40 pixels. `num_near` of eight source views stand within half a
// metre, alternately left and right; the others stand so far aside that no pixel's point is in them.
struct WallWithAHole {
  SceneView views[9];
  InferenceInput input;

  explicit WallWithAHole(int num_near) {
    views[0] = MakeView("reference", 0);
    input.reference = {&views[0], TexturedWall(0)};
    for (int j = 1; j <= 8; ++j) {
      const double aside = j <= num_near ? 0.15 : 30;
      const double baseline = (j % 2 == 0 ? -aside : aside) * ((j + 1) / 2);
      views[j] = MakeView("source" + std::to_string(j), baseline);
      input.sources.push_back({&views[j], TexturedWall(baseline)});
    }
    auto measured = std::make_shared<PlaneMap>(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (!InHole(x, y)) (*measured)(x, y) = {{0, 0, -1}, static_cast<float>(kDepth)};
      }
    }
    input.measured = std::make_shared<const MeasurementMap>(AllMeasured(*measured));
  }
};

std::int64_t NumFilled(const InferenceResult& result) {
  return std::count_if(result.map.states.begin(), result.map.states.end(), IsInferred);
}

InferenceResult Infer(const InferenceInput& input, InferenceMode mode) {
  InferenceOptions options;
  options.mode = mode;
  return InferPlanes(input, StereoOptions(), options);
}

constexpr InferenceMode kModes[] = {InferenceMode::kMinCost, InferenceMode::kMrf};

TEST(TexturedHoles, HoweverFewViewsSeeThemTheyAreFilled) {
  for (const InferenceMode mode : kModes) {
    for (const int num_near : {0, 1, 2, 3, 8}) {
      EXPECT_EQ(NumFilled(Infer(WallWithAHole(num_near).input, mode)), 40 * 40) << num_near;
    }
  }
}

}  // namespace
}  // namespace phi

// Cells on a plane, and an even region above a roof whose plane goes on into it: is it the sky?
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "phi/backend.h"
#include "phi/inference/anchor_cells.h"
#include "phi/inference/image_plane.h"
#include "phi/inference/spot.h"
#include "tests/support/centered_view.h"

namespace phi {

// One every 10 pixels in a rectangle, on the plane times `factor`.
inline std::vector<AnchorCell> CellsOn(const ImagePlane& plane, int x0, int x1, int y0, int y1, double factor = 1) {
  std::vector<AnchorCell> cells;
  for (int y = y0; y < y1; y += 10) {
    for (int x = x0; x < x1; x += 10) {
      const double w = factor * plane.InverseDepth(x, y);
      cells.push_back({static_cast<float>(x), static_cast<float>(y), w, 0.003 * w, x / 10, y / 10});
    }
  }
  return cells;
}

inline const ImagePlane kRoof{0.3, 0.001, 0};

// The image above a roof, all of one brightness. Two source cameras, half a metre to the left and to the right, face as the
// reference does, so that they show the sky where the reference shows it, and the roof's plane 24 to 28 columns to a side of it. What
// they show at the columns 0 to 69 of some spots decides.
struct AboveARoof {
  SceneView reference = test_support::CenteredView(1, 160, 120, 150);
  std::array<SceneView, 2> sources = {test_support::CenteredView(2, 160, 120, 150), test_support::CenteredView(3, 160, 120, 150)};
  InferenceInput input;
  std::vector<AnchorCell> roof = CellsOn(kRoof, 0, 160, 60, 120);
  std::vector<Spot> spots;  // two of five rows lie on the roof

  AboveARoof(std::uint8_t first_left, std::uint8_t second_left) {
    const auto image = [](std::uint8_t left) {
      auto plain = std::make_shared<GrayImage>(160, 120, std::uint8_t{100});
      for (int y = 0; y < 120; ++y) {
        for (int x = 15; x < 70; x += 10) (*plain)(x, y) = left;
      }
      return plain;
    };
    input.reference = {&reference, image(100)};
    for (int j = 0; j < 2; ++j) {
      sources[j].camera.pose.translation = {j == 0 ? -0.5 : 0.5, 0, 0};
      input.sources.push_back({&sources[j], image(j == 0 ? first_left : second_left)});
      input.source_depths.push_back(std::make_shared<const MeasuredDepths>(AllMeasured(DepthMap(160, 120))));
    }
    for (int x = 15; x < 145; x += 10) {
      for (const int y : {5, 15, 25, 75, 85}) spots.push_back({x, y});
    }
  }
};

}  // namespace phi

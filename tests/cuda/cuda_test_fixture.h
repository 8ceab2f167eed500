// Skips visibly where there is no CUDA device.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "cuda/cuda_backend.h"

namespace phi::gpu {

class CudaTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string why_none;
    if (NumCudaDevices(&why_none) == 0) GTEST_SKIP() << why_none;
  }
};

// A scene's view as the reference of an estimation, all others as its sources.
template <class Scene>
EstimationInput MakeInput(const Scene& scene, int reference, float depth_min, float depth_max) {
  EstimationInput input;
  input.reference = scene.Image(reference);
  input.sources = scene.SourceImages(reference);
  input.noise = 2;  // so that wide windows are taken, too
  input.depth_min = depth_min;
  input.depth_max = depth_max;
  return input;
}

// Percentage of pixels with a true depth whose estimate is within `tolerance` of it, relatively.
inline double PercentCorrect(const PlaneMap& map, const PlaneMap& truth, double tolerance) {
  std::size_t count = 0, correct = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double depth = truth.data()[i].depth;
    if (!(depth > 0)) continue;
    ++count;
    correct += std::abs(map.data()[i].depth - depth) < tolerance * depth;
  }
  return 100.0 * static_cast<double>(correct) / static_cast<double>(count);
}

}  // namespace phi::gpu

#include "phi/inference/hypotheses.h"

#include <utility>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

Array2D<float> InverseDepth(const PlaneMap& map) {
  Array2D<float> result(map.width(), map.height(), 0.0f);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (map.data()[i].depth > 0) result.data()[i] = 1 / map.data()[i].depth;
  }
  return result;
}

}  // namespace

Hypotheses::Hypotheses(const PlaneMap& measured, Formulas formulas)
    : measured_inverse_depth_(InverseDepth(measured)) {
  const int width = measured.width(), height = measured.height();
  LineOptions options;
  options.literal = formulas == Formulas::kPaper;
  const ArrayView2D<const float> inverse_depth = std::as_const(measured_inverse_depth_).view();
  Array2D<Support> supports(width, height);
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) supports(x, y) = MakeSupport(inverse_depth, x, y, options);
  });
  const Array2D<Support>& const_supports = supports;
  for (int direction = 0; direction < kNumDirections; ++direction) {
    inverse_depth_[direction] = measured_inverse_depth_;
    tbb::parallel_for(0, NumScanlines(direction, width, height), [&](int index) {
      FillScanline(MakeScanline(direction, index, width, height), const_supports.view(), options,
                   inverse_depth_[direction].view());
    });
  }
}

HypothesisMaps Hypotheses::maps() const {
  HypothesisMaps maps;
  for (int k = 0; k < kNumDirections; ++k) maps.inverse_depth[k] = inverse_depth_[k].view();
  return maps;
}

}  // namespace phi

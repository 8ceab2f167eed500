#include "phi/inference/hypotheses.h"

#include <cstddef>

#include <tbb/parallel_for.h>

#include "phi/base/whole_array.h"

namespace phi {
namespace {

// value(state, depth) of each pixel.
template <typename Value>
Array2D<float> InverseDepth(const MeasurementMap& map, const Value& value) {
  auto inverse_depth = Array2D<float>::Uninitialized(map.width(), map.height());
  ForParts(map.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      inverse_depth.data()[i] = value(map.states.data()[i], map.planes.data()[i].depth);
    }
  });
  return inverse_depth;
}

}  // namespace

Hypotheses::Hypotheses(const MeasurementMap& measured, const Method& method, const GrayImage* image,
                       std::uint32_t image_id, const PlaneEvidence& evidence)
    : evidence_(InverseDepth(measured, EvidenceAt)) {
  const int width = measured.width(), height = measured.height();
  const Formulas formulas = method.formulas;
  const LineOptions options = MakeLineOptions(method);
  const Array2D<float> carrying = InverseDepth(
      measured, [formulas](PixelState state, float depth) { return AnchorAt(state, depth, formulas); });
  const ArrayView2D<const float> anchors = carrying.view();
  for (int direction = 0; direction < kNumDirections; ++direction) {
    inverse_depth_[direction] = Transformed(carrying, [](float w) { return w; });
    tbb::parallel_for(0, NumScanlines(direction, width, height), [&](int index) {
      FillScanline(MakeScanline(direction, index, width, height), anchors, options,
                   inverse_depth_[direction].view());
    });
  }
  if (image != nullptr && formulas == Formulas::kRobust) {
    region_planes_.emplace(*image, anchors, image_id, evidence, method.rules);
    AddRegionPlanes(*image, method.rules);
  }
}

void Hypotheses::AddRegionPlanes(const GrayImage& image, const Rules& rules) {
  from_region_ = Array2D<std::uint8_t>(evidence_.width(), evidence_.height(), 0);
  ArrayView2D<float> maps[kNumDirections];
  for (int k = 0; k < kNumDirections; ++k) maps[k] = inverse_depth_[k].view();
  tbb::parallel_for(0, evidence_.height(), [&](int y) {
    for (int x = 0; x < evidence_.width(); ++x) {
      if (evidence_(x, y) > 0) continue;
      const auto& region = region_planes_->At(x, y);
      float planes[kPlanesPerRegion];
      for (int i = 0; i < kPlanesPerRegion; ++i) planes[i] = region[i].At(x, y);
      from_region_(x, y) =
          PutRegionPlanes(planes, rules.IsOn(Rule::kOverexposed) ? image(x, y) : 0, x, y, maps);
    }
  });
}

HypothesisState Hypotheses::state() const {
  HypothesisState state{.evidence = evidence_.view()};
  for (int k = 0; k < kNumDirections; ++k) state.maps.inverse_depth[k] = inverse_depth_[k].view();
  if (from_region_.size() > 0) state.from_region = from_region_.view();
  return state;
}

}  // namespace phi

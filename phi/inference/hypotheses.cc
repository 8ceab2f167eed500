#include "phi/inference/hypotheses.h"

#include <cstddef>
#include <utility>

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

Array2D<float> AnchorMap(const MeasurementMap& map, Formulas formulas) {
  return InverseDepth(map, [formulas](PixelState state, float depth) { return AnchorAt(state, depth, formulas); });
}

Hypotheses::Hypotheses(const MeasurementMap& measured, const Method& method)
    : evidence_(InverseDepth(measured, EvidenceAt)) {
  FillScanlines(AnchorMap(measured, method.formulas), {}, method);
}

Hypotheses::Hypotheses(const MeasurementMap& measured, const Rules& rules, const GrayImage& image, Array2D<float> anchors,
                       RegionPlanes planes)
    : evidence_(InverseDepth(measured, EvidenceAt)), region_planes_(std::move(planes)) {
  const Mask limits = region_planes_->LineLimits(std::as_const(anchors).view(), rules);
  ForParts(anchors.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      anchors.data()[i] = LineAnchor(anchors.data()[i], evidence_.data()[i], limits.data()[i]);
    }
  });
  FillScanlines(anchors, limits.view(), {Formulas::kRobust, rules});
  AddRegionPlanes(image, rules);
}

void Hypotheses::FillScanlines(const Array2D<float>& anchors, ArrayView2D<const std::uint8_t> limits,
                               const Method& method) {
  const int width = anchors.width(), height = anchors.height();
  const LineOptions options = MakeLineOptions(method);
  for (int direction = 0; direction < kNumDirections; ++direction) {
    inverse_depth_[direction] = Transformed(anchors, [](float w) { return w; });
    tbb::parallel_for(0, NumScanlines(direction, width, height), [&](int index) {
      FillScanline(MakeScanline(direction, index, width, height), anchors.view(), limits, options,
                   inverse_depth_[direction].view());
    });
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

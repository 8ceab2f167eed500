#include "phi/inference/hypotheses.h"

#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/base/whole_array.h"

namespace phi {
namespace {

// Of the pixels whose state `counts`; 0 elsewhere.
template <typename Counts>
Array2D<float> InverseDepth(const MeasurementMap& map, const Counts& counts) {
  auto inverse_depth = Array2D<float>::Uninitialized(map.width(), map.height());
  ForParts(map.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      inverse_depth.data()[i] = counts(map.states.data()[i]) ? 1 / map.planes.data()[i].depth : 0.0f;
    }
  });
  return inverse_depth;
}

// Doubtful pixels support lines and planes as measured ones do; not in the paper's form.
Array2D<float> SupportingInverseDepth(const MeasurementMap& map, Formulas formulas) {
  return formulas == Formulas::kPaper ? InverseDepth(map, IsEvidence) : InverseDepth(map, CarriesPlanes);
}

// What is there before the lines: measured depth, and the support's at doubtful pixels, which belong to no gap.
Array2D<float> StartHypotheses(const Array2D<float>& evidence, const Array2D<Support>& supports) {
  auto start = Array2D<float>::Uninitialized(evidence.width(), evidence.height());
  ForParts(start.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      start.data()[i] = StartHypothesis(evidence.data()[i], supports.data()[i]);
    }
  });
  return start;
}

}  // namespace

Hypotheses::Hypotheses(const MeasurementMap& measured, Formulas formulas, const GrayImage* image,
                       std::uint32_t image_id, std::span<const PooledSupport> pooled,
                       const DepthPrecision& precision)
    : measured_inverse_depth_(InverseDepth(measured, IsEvidence)) {
  const int width = measured.width(), height = measured.height();
  LineOptions options;
  options.formulas = formulas;
  const Array2D<float> supporting = SupportingInverseDepth(measured, formulas);
  const ArrayView2D<const float> inverse_depth = supporting.view();
  auto supports = Array2D<Support>::Uninitialized(width, height);
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) supports(x, y) = MakeSupport(inverse_depth, x, y, options);
  });
  const Array2D<Support>& const_supports = supports;
  const Array2D<float> start = StartHypotheses(measured_inverse_depth_, const_supports);
  for (int direction = 0; direction < kNumDirections; ++direction) {
    inverse_depth_[direction] = Transformed(start, [](float w) { return w; });
    tbb::parallel_for(0, NumScanlines(direction, width, height), [&](int index) {
      FillScanline(MakeScanline(direction, index, width, height), const_supports.view(), options,
                   inverse_depth_[direction].view());
    });
  }
  if (image != nullptr && formulas == Formulas::kRobust) {
    region_planes_.emplace(*image, ValuesOf(const_supports.view()), image_id, pooled, precision);
    ReplaceDiagonals(*region_planes_);
    RemoveOverexposed(*image);
  }
}

void Hypotheses::ReplaceDiagonals(const RegionPlanes& planes) {
  constexpr int kReplaced[kPlanesPerRegion] = {kDescending, kAscending};
  from_region_ = Array2D<std::uint8_t>(measured_inverse_depth_.width(), measured_inverse_depth_.height(), 0);
  tbb::parallel_for(0, measured_inverse_depth_.height(), [&](int y) {
    for (int x = 0; x < measured_inverse_depth_.width(); ++x) {
      if (measured(x, y)) continue;
      const auto& region = planes.At(x, y);
      for (int k = 0; k < kPlanesPerRegion; ++k) {
        const float w = region[k].At(x, y);
        if (!(w > 0)) continue;
        inverse_depth_[kReplaced[k]](x, y) = w;
        from_region_(x, y) |= static_cast<std::uint8_t>(1 << kReplaced[k]);
      }
    }
  });
}

void Hypotheses::RemoveOverexposed(const GrayImage& image) {
  constexpr int kOverexposed = 250;
  ForParts(image.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (image.data()[i] < kOverexposed || measured_inverse_depth_.data()[i] > 0) continue;
      for (Array2D<float>& map : inverse_depth_) map.data()[i] = 0;
    }
  });
}

HypothesisMaps Hypotheses::maps() const {
  HypothesisMaps maps;
  for (int k = 0; k < kNumDirections; ++k) maps.inverse_depth[k] = inverse_depth_[k].view();
  return maps;
}

}  // namespace phi

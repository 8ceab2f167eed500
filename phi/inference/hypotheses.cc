#include "phi/inference/hypotheses.h"

#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/base/whole_array.h"

namespace phi {
namespace {

Array2D<float> InverseDepth(const PlaneMap& map) {
  return Transformed(map, [](const PlaneHypothesis& h) { return h.depth > 0 ? 1 / h.depth : 0.0f; });
}

// Doubtful pixels support lines and planes as measured ones do; not in the paper's form.
Array2D<float> SupportingInverseDepth(const PlaneMap& map, Formulas formulas) {
  if (formulas == Formulas::kPaper) return InverseDepth(map);
  return Transformed(map,
                     [](const PlaneHypothesis& h) { return h.depth != 0 ? 1 / std::abs(h.depth) : 0.0f; });
}

// What is there before the lines: measured depth, and the support's at doubtful pixels, which belong to no gap.
Array2D<float> StartHypotheses(const PlaneMap& measured, const Array2D<Support>& supports) {
  auto start = Array2D<float>::Uninitialized(measured.width(), measured.height());
  ForParts(start.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      start.data()[i] = StartHypothesis(measured.data()[i].depth, supports.data()[i]);
    }
  });
  return start;
}

}  // namespace

Hypotheses::Hypotheses(const PlaneMap& measured, Formulas formulas, const GrayImage* image,
                       std::uint32_t image_id, std::span<const PooledSupport> pooled,
                       const DepthPrecision& precision)
    : measured_inverse_depth_(InverseDepth(measured)) {
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
  const Array2D<float> start = StartHypotheses(measured, const_supports);
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

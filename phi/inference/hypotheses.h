// The four hypothesis maps of an image.
#pragma once

#include <array>
#include <optional>

#include "phi/base/images.h"
#include "phi/inference/image_regions.h"
#include "phi/inference/infer_pixel.h"
#include "phi/inference/region_planes.h"
#include "phi/measurement.h"

namespace phi {

// Inverse depth of what carries hypotheses: AnchorAt.
Array2D<float> AnchorMap(const MeasurementMap& map, Formulas formulas);

class Hypotheses {
 public:
  // Lines alone.
  Hypotheses(const MeasurementMap& measured, const Method& method);
  // Robust: in the image's evenly coloured regions lines go between two sides only, and planes take the diagonals' places where
  // there are any; where a region may be the sky, lines rest on what was measured alone; overexposed holes get no hypothesis, since
  // nothing in the image says that windows, lamps or sky are a surface. `anchors`: AnchorMap, of which `planes` were found.
  Hypotheses(const MeasurementMap& measured, const Rules& rules, const GrayImage& image, Array2D<float> anchors, RegionPlanes planes);

  // Views this.
  HypothesisState state() const;
  // Null: none were looked for.
  const RegionPlanes* region_planes() const { return region_planes_ ? &*region_planes_ : nullptr; }

 private:
  void FillScanlines(const Array2D<float>& anchors, ArrayView2D<const std::uint8_t> limits, const Method& method);
  void AddRegionPlanes(const GrayImage& image, const Rules& rules);

  Array2D<float> evidence_;  // inverse depth
  std::optional<RegionPlanes> region_planes_;
  Array2D<std::uint8_t> from_region_;  // empty: none
  std::array<Array2D<float>, kNumDirections> inverse_depth_;
};

}  // namespace phi

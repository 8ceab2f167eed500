#include "phi/inference/region_planes.h"

#include <algorithm>
#include <memory>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/base/error.h"
#include "phi/base/image_mask.h"
#include "phi/inference/fitted_planes.h"
#include "phi/inference/infer_pixel.h"
#include "phi/inference/view_choice.h"

namespace phi {
namespace {

std::uint8_t LimitOf(Sky sky) {
  switch (sky) {
    case Sky::kNot: return 0;
    case Sky::kMayBe: return kMeasuredOnly;
    case Sky::kSeen: return kMeasuredOnly | kNoLine;
  }
  return 0;
}

}  // namespace

ViewRegions FindViewRegions(std::shared_ptr<const ImageRegions> regions, const MeasuredDepths& depths, std::uint32_t image_id,
                            const DepthPrecision& precision, const Rules& rules) {
  auto anchors = Array2D<float>::Uninitialized(depths.width(), depths.height());
  tbb::parallel_for(0, depths.height(), [&](int y) {
    for (int x = 0; x < depths.width(); ++x) {
      anchors(x, y) = AnchorAt(depths.states(x, y), depths.depths(x, y), Formulas::kRobust);
    }
  });
  PlaneEvidence own;
  own.precision = precision;
  own.states = depths.states.view();
  return RegionPlanes(std::move(regions), std::as_const(anchors).view(), image_id, own, rules).Tell();
}

std::shared_ptr<const ImageRegions> RegionsOf(const InferenceInput& input, const Rules& rules) {
  if (input.regions != nullptr) return input.regions;
  const GrayImage& image = *input.reference.image;
  return std::make_shared<const ImageRegions>(FindRegions(input.mask == nullptr ? image : CutOutMask(image, *input.mask), rules));
}

RegionPlanes::RegionPlanes(std::shared_ptr<const ImageRegions> regions, ArrayView2D<const float> anchors,
                           std::uint32_t image_id, const PlaneEvidence& evidence, const Rules& rules)
    : tolerance_(RegionTolerance(evidence.precision, rules)),
      regions_(std::move(regions)),
      fitted_(FitRegions(*regions_, anchors, image_id, evidence, rules)) {}

bool RegionPlanes::ShowsSky() const {
  return std::any_of(fitted_.regions.begin(), fitted_.regions.end(), [](const FittedRegion& r) { return r.sky == Sky::kSeen; });
}

Mask RegionPlanes::LineLimits(ArrayView2D<const float> anchors, const Rules& rules) const {
  const std::uint8_t even = rules.IsOn(Rule::kEvenLines) ? kBetweenSidesOnly : 0;
  const double min_apart = RegionFitLimits(rules).min_apart;
  auto limits = Mask::Uninitialized(anchors.width, anchors.height);
  tbb::parallel_for(0, anchors.height, [&](int y) {
    ForRunsOfRow(*regions_, y, [&](std::int32_t region, int begin, int end) {
      const FittedRegion* fitted = Fitted(region);
      const std::uint8_t of_all = (region < 0 ? 0 : even) | (fitted == nullptr ? 0 : LimitOf(fitted->sky));
      std::fill(&limits(begin, y), &limits(begin, y) + (end - begin), of_all);
      if (fitted == nullptr || !fitted->is_mirror) return;
      for (int x = begin; x < end; ++x) {
        const AnchorPoint anchor = {static_cast<float>(x), static_cast<float>(y), anchors(x, y)};
        if (anchor.w > 0 && IsBehind(fitted->planes[0], anchor, min_apart)) limits(x, y) |= kReflected;
      }
    });
  });
  return limits;
}

ViewRegions RegionPlanes::Tell() const {
  ViewRegions told;
  const SpotGrid grid(regions_->region.width(), regions_->region.height());
  told.label = Array2D<std::int32_t>(grid.columns, grid.rows, -1);
  for (const FittedRegion& region : fitted_.regions) told.regions.push_back({{}, region.cells, region.continued, region.planes});
  for (std::size_t i = 0; i < fitted_.index.size(); ++i) {
    const std::int32_t k = fitted_.index[i];
    if (k >= 0) told.regions[static_cast<std::size_t>(k)].image_region = static_cast<std::int32_t>(i);
  }
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Spot spot = grid.At(column, row);
      const std::int32_t region = IndexOf(RegionAt(spot.x, spot.y));
      told.label(column, row) = region;
      if (region < 0) continue;
      told.regions[static_cast<std::size_t>(region)].box.AddCell(column, row, grid.step);
    }
  }
  return told;
}

RegionPlanes FindRegionPlanes(const InferenceInput& input, std::shared_ptr<const ImageRegions> regions,
                              ArrayView2D<const float> anchors, const Rules& rules) {
  if (input.choice == nullptr) {
    return {std::move(regions), anchors, input.reference.view->image_id, GatherPlaneEvidence(input, rules), rules};
  }
  if (std::ssize(input.choice->fitted.index) != regions->num_regions) {
    throw UsageError("plane inference of image " + AboutImage(input.reference.view->name) + ": its first choice is of other regions");
  }
  if (input.choice->exposures.size() != input.sources.size()) {
    throw InputError("plane inference of image " + AboutImage(input.reference.view->name) +
                     ": a source image could be read at one time and not at another; run patch_match_stereo again");
  }
  const PlaneEvidence evidence = EvidenceForChoosingAgain(input, *input.choice, rules);
  FittedRegions fitted = FitAgain(*regions, anchors, input.choice->fitted, evidence, rules);
  return {std::move(regions), RegionTolerance(evidence.precision, rules), std::move(fitted)};
}

}  // namespace phi

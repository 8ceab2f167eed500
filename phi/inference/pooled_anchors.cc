#include "phi/inference/pooled_anchors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/base/images.h"
#include "phi/base/random.h"
#include "phi/geometry/depth_agreement.h"
#include "phi/inference/shown_point.h"
#include "phi/inference/source_anchors.h"

namespace phi {
namespace {

// Of the sampled pixels every so many in each direction tell how much brighter the reference image is.
constexpr int kGainStride = 4;
constexpr int kMinGainSamples = 100;
// Of them so many hold back what is told of tones.
constexpr double kTonePrior = 0.03;
// Grey levels: darker ones are mostly noise, brighter ones may be clipped.
constexpr int kMinGainBrightness = 20, kMaxGainBrightness = 240;
// Neighbours tell a plane nothing new, and all source views together still outnumber the reference's own anchors.
constexpr int kMinStep = 2;

int StepOf(int width, int height, const Rules& rules) {
  return SamplingStep(width, height, rules.Count(Rule::kPooledAnchors, kMinStep), kMaxPooledPerView);
}

class SourcePool {
 public:
  SourcePool(const InferenceInput& input, const ViewImage& source, const MeasuredDepths& depths, const Rules& rules)
      : measured_(*input.measured),
        mask_(input.mask.get()),
        reference_image_(*input.reference.image),
        source_image_(*source.image),
        depths_(depths),
        rules_(rules),
        step_(StepOf(depths.width(), depths.height(), rules)),
        source_id_(source.view->image_id),
        projected_(source, depths, input.reference.view->camera),
        reference_frame_(input.reference.view->camera.pinhole),
        source_frame_(source.view->camera.pinhole) {}

  int NumRows() const { return (depths_.height() + step_ - 1) / step_; }

  // Sampled row `row`.
  std::vector<PooledAnchor> Row(int row) const {
    std::vector<PooledAnchor> anchors;
    ForRow(row * step_, step_, [&](int x, int y, const PooledAnchor& anchor) { AddAnchor(x, y, anchor, &anchors); });
    anchors.shrink_to_fit();  // all rows wait for each other
    return anchors;
  }

  // Spots that both measured. Exposure scales radiance, which a camera's gamma curve makes a factor of grey levels too.
  std::vector<SpotPair> SharedSpots() const {
    std::vector<SpotPair> pairs;
    for (int y = 0; y < depths_.height(); y += kGainStride * step_) {
      ForRow(y, kGainStride * step_, [&](int x, int y, const PooledAnchor& anchor) { AddPair(x, y, anchor, &pairs); });
    }
    return pairs;
  }

  void SetExposure(const RelativeExposure& exposure) { exposure_ = exposure; }

 private:
  // function(x, y, anchor) for every `step`th pixel of the source's row y that has a depth and lands in the reference: as an anchor of
  // it, without its hash.
  template <typename Function>
  void ForRow(int y, int step, const Function& function) const {
    SourceAnchorRow row;
    projected_.FindRow(y, step, &row);
    for (std::size_t i = 0; i < row.u.size(); ++i) {
      const float u = row.u[i], v = row.v[i], w = row.inverse_depth[i];
      if (!(w > 0 && IsInImage(u, v, measured_.width(), measured_.height()))) continue;
      function(static_cast<int>(i) * step, y, PooledAnchor{u - 0.5f, v - 0.5f, w});
    }
  }

  void AddAnchor(int x, int y, const PooledAnchor& found, std::vector<PooledAnchor>* row) const {
    const int px = found.PixelX(), py = found.PixelY();
    // The reference's own measurement knows better what is there.
    if (CarriesPlanes(measured_.states(px, py))) return;
    if (mask_ != nullptr && (*mask_)(px, py) == 0) return;
    const float change = exposure_.Change(InReference(px, py), InSource(x, y));
    if (!(std::abs(change) <= rules_.Scale(Rule::kPooledAnchors) * kMaxBrightnessChange)) return;
    PooledAnchor& anchor = row->emplace_back(found);
    anchor.hash = Hash(x, y);
    anchor.is_measured = IsMeasured(depths_.states(x, y));
  }

  BrightSpot InReference(int x, int y) const { return reference_frame_.Spot(x, y, static_cast<float>(reference_image_(x, y))); }
  BrightSpot InSource(int x, int y) const { return source_frame_.Spot(x, y, static_cast<float>(source_image_(x, y))); }

  void AddPair(int x, int y, const PooledAnchor& anchor, std::vector<SpotPair>* pairs) const {
    const int px = anchor.PixelX(), py = anchor.PixelY();
    if (!CarriesPlanes(measured_.states(px, py))) return;
    const float there = measured_.planes(px, py).depth;
    if (!(std::abs(there * anchor.inverse_depth - 1) <= kSameDepth)) return;
    const SpotPair pair = {InReference(px, py), InSource(x, y)};
    const auto [least, most] = std::minmax(pair.reference.brightness, pair.source.brightness);
    if (least >= kMinGainBrightness && most <= kMaxGainBrightness) pairs->push_back(pair);
  }

  std::uint32_t Hash(int x, int y) const {
    return Philox({0, source_id_}, static_cast<std::uint64_t>(y) * depths_.width() + x, 0, 0).v[0];
  }

  const MeasurementMap& measured_;
  const ImageMask* mask_;  // null: nothing is left out
  const GrayImage& reference_image_;
  const GrayImage& source_image_;
  const MeasuredDepths& depths_;
  const Rules& rules_;
  int step_;
  RelativeExposure exposure_;
  std::uint32_t source_id_;
  SourceAnchors projected_;
  PhotoFrame reference_frame_, source_frame_;
};

}  // namespace

std::vector<PooledAnchor> PoolAnchors(const InferenceInput& input, const Rules& rules,
                                      std::vector<RelativeExposure>* exposures) {
  if (exposures != nullptr) exposures->assign(input.sources.size(), RelativeExposure());
  if (!rules.IsOn(Rule::kPooledAnchors)) return {};
  std::vector<SourcePool> sources;
  std::vector<std::size_t> views;                 // of sources
  std::vector<std::pair<std::size_t, int>> rows;  // of sources
  const std::size_t num_views =
      std::min<std::size_t>({input.sources.size(), input.source_depths.size(), kMaxSourceViews});
  for (std::size_t j = 0; j < num_views; ++j) {
    if (input.source_depths[j] == nullptr) continue;
    sources.emplace_back(input, input.sources[j], *input.source_depths[j], rules);
    views.push_back(j);
    for (int row = 0; row < sources.back().NumRows(); ++row) rows.emplace_back(sources.size() - 1, row);
  }
  std::vector<std::vector<SpotPair>> spots(sources.size());
  tbb::parallel_for(std::size_t{0}, sources.size(), [&](std::size_t j) { spots[j] = sources[j].SharedSpots(); });
  const std::vector<RelativeExposure> fitted =
      RelativeExposure::Fit(spots, static_cast<std::size_t>(rules.Count(Rule::kPooledAnchors, kMinGainSamples)),
                            kTonePrior * rules.Factor(Rule::kPhotoTones));
  for (std::size_t j = 0; j < sources.size(); ++j) {
    sources[j].SetExposure(fitted[j]);
    if (exposures != nullptr) (*exposures)[views[j]] = fitted[j];
  }
  std::vector<std::vector<PooledAnchor>> anchors(rows.size());
  tbb::parallel_for(std::size_t{0}, rows.size(),
                    [&](std::size_t i) { anchors[i] = sources[rows[i].first].Row(rows[i].second); });
  std::size_t num_anchors = 0;
  for (const auto& row : anchors) num_anchors += row.size();
  std::vector<PooledAnchor> pooled;
  pooled.reserve(num_anchors);
  for (auto& row : anchors) {
    pooled.insert(pooled.end(), row.begin(), row.end());
    row = {};
  }
  return pooled;
}

}  // namespace phi

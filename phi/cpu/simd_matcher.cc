#include "phi/cpu/simd_matcher.h"

#include <bit>
#include <utility>

#include "phi/matching/pyramid.h"

namespace phi {
SimdMatcher::SimdMatcher(const EstimationInput& input, const EstimationParameters& parameters,
                         const std::vector<RelativeView>& views)
    : rays_(parameters.reference),
      matching_window_(parameters.window),
      window_(parameters.window),
      narrow_window_(parameters.window.Narrow()) {
  const int num_levels = parameters.num_levels;
  const std::vector<GrayImage> reference = BuildPyramid(*input.reference.image, num_levels);
  levels_.push_back({PackedImage(*input.reference.image), {}, {}});
  for (const GrayImage& image : reference) levels_.push_back({PackedImage(image), {}, {}});
  for (const ViewImage& source : input.sources) {
    levels_[0].images.emplace_back(*source.image);
    const std::vector<GrayImage> coarser = BuildPyramid(*source.image, num_levels);
    for (int l = 1; l < num_levels; ++l) levels_[l].images.emplace_back(coarser[l - 1]);
  }
  for (int l = 0; l < num_levels; ++l) {
    const float scale = 1.0f / static_cast<float>(1 << l);
    std::vector<RelativeView> scaled;
    for (const RelativeView& view : views) scaled.push_back(ScaleView(view, scale));
    levels_[l].sources = SimdSources(levels_[l].images, scaled);
  }
  window_scales_ = SelectScales();
}

// As SelectWindowScales of pyramid.h does, but for rounding.
Array2D<WindowScale> SimdMatcher::SelectScales() const {
  const auto variance = [this](int level, bool is_narrow, float u, float v) {
    SimdPatch patch;
    LoadSimdPatch(levels_[level].reference, is_narrow ? narrow_window_ : window_, matching_window_.weight_decay, u, v, &patch);
    return patch.all.variance;
  };
  const PackedImage& reference = levels_[0].reference;
  return ScalesOfPixels(reference.width(), reference.height(), [&](float u, float v) {
    return SelectWindowScaleBy(variance, static_cast<int>(levels_.size()), matching_window_, u, v);
  });
}

void SimdMatcher::SumSparse(const Patch& patch, int x, int y, const PlaneHypothesis& h, Ranked* ranked) const {
  const float u = x + 0.5f, v = y + 0.5f;
  const auto step = static_cast<float>(1 << patch.scale.level);  // pixels of level 0 per pixel of the level
  const float offset = step / (h.depth * Dot(h.normal, patch.ray));
  const PlaneAtPoint plane = {u / step, v / step, 1.0 / h.depth, offset * h.normal.x / rays_.fx, offset * h.normal.y / rays_.fy};
  SumSparseSamples(Window(patch.scale), levels_[patch.scale.level].sources, patch.samples, plane, ranked);
}

int SimdMatcher::Rank(const Patch& patch, int x, int y, const PlaneHypothesis& h, Ranked* ranked, float* costs) const {
  ranked->inside = 0;
  if (patch.samples.sparse.textured || patch.samples.all.textured) SumSparse(patch, x, y, h, ranked);
  CostsOfSums(patch.samples.sparse, *ranked, levels_[patch.scale.level].sources.num, costs);
  return std::popcount(ranked->inside);
}

int SimdMatcher::Score(const Patch& patch, Ranked* ranked, float* costs) const {
  const SimdSources& sources = levels_[patch.scale.level].sources;
  if (patch.samples.all.textured) AddOtherSamples(Window(patch.scale), sources, patch.samples, ranked);
  CostsOfSums(patch.samples.all, *ranked, sources.num, costs);
  return patch.samples.all.textured ? std::popcount(ranked->inside) : 0;
}

int SimdMatcher::Costs(const Patch& patch, int x, int y, const PlaneHypothesis& h, Samples samples, float* costs) const {
  Ranked ranked;
  const int num_read = Rank(patch, x, y, h, &ranked, costs);
  return samples == Samples::kAll ? Score(patch, &ranked, costs) : num_read;
}

}  // namespace phi

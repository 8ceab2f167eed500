// Compiled once for each instruction set: foreach_target.h includes this file again.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "phi/cpu/simd_zncc.cc"
#include "phi/base/simd_targets.h"
#include "phi/cpu/simd_zncc.h"

#include <algorithm>
#include <cmath>

// foreach_target.h must come before what it compiles again.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "phi/cpu/local_warps-inl.h"
#include "phi/cpu/window_samples-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace phi {
namespace HWY_NAMESPACE {

// Sums over samples of the reference.
struct ReferenceSums {
  float weight = 0, sum = 0, squares = 0;
};

HWY_INLINE ReferenceSums SumReference(const SimdPatch& patch, const float* samples, int begin, int end) {
  const Floats df;
  Totals weight, sum, squares;
  for (int i = begin; i < end; i += kSimdChunk) {
    for (int p = 0; p < kParts; ++p) {
      const int k = i + p * kLanes;
      const VF weighted = hn::Load(df, patch.weighted + k);
      weight.part[p] = hn::Add(weight.part[p], hn::Load(df, patch.weights + k));
      sum.part[p] = hn::Add(sum.part[p], weighted);
      squares.part[p] = hn::MulAdd(weighted, hn::Load(df, samples + k), squares.part[p]);
    }
  }
  alignas(16) float joined[4];
  Join<false>(weight, sum, squares, joined);
  return {joined[0], joined[1], joined[2]};
}

SimdReference MakeReference(const ReferenceSums& sums) {
  SimdReference reference;
  reference.inverse_weight = 1.0f / sums.weight;
  reference.mean = sums.sum * reference.inverse_weight;
  reference.variance = sums.squares * reference.inverse_weight - reference.mean * reference.mean;
  reference.textured = reference.variance >= kMinVariance;
  reference.inverse_deviation = reference.textured ? 1.0f / std::sqrt(reference.variance) : 0.0f;
  return reference;
}

void LoadPatch(const PackedImage& reference, const SimdWindow& window, float weight_decay, float u, float v,
               SimdPatch* patch) {
  const Floats df;
  const VF x_last = hn::Set(df, static_cast<float>(reference.width() - 1));
  const VF y_last = hn::Set(df, static_cast<float>(reference.height() - 1));
  const VF x_center = hn::Set(df, u - 0.5f), y_center = hn::Set(df, v - 0.5f), zero = hn::Zero(df);
  const auto stride = hn::Set(Ints(), static_cast<std::int32_t>(reference.stride()));
  const int padded = static_cast<int>(window.dx.size());
  // The centre, clamped as all samples are.
  const float x_shift = std::clamp(u - 0.5f, 0.0f, static_cast<float>(reference.width() - 1));
  const float y_shift = std::clamp(v - 0.5f, 0.0f, static_cast<float>(reference.height() - 1));
  const VF shift = hn::Set(df, SampleAt(reference.origin(), reference.stride(), x_shift, y_shift));
  const VF decay = hn::Set(df, -weight_decay);
  alignas(64) float samples[kMaxSimdSamples];
  for (int k = 0; k < padded; k += kLanes) {
    const VF x = hn::Min(hn::Max(hn::Add(x_center, hn::LoadU(df, window.dx.data() + k)), zero), x_last);
    const VF y = hn::Min(hn::Max(hn::Add(y_center, hn::LoadU(df, window.dy.data() + k)), zero), y_last);
    const VF sample = hn::Sub(Sample(reference.origin(), stride, PlaceOf(x), PlaceOf(y)), shift);
    hn::Store(sample, df, samples + k);
    hn::Store(Exp2(hn::Mul(hn::Mul(decay, sample), sample)), df, patch->weights + k);
  }
  // The padding repeats the centre and must not count.
  const int num_rest = window.num_samples - window.num_sparse;
  std::fill(patch->weights + window.num_sparse - 1, patch->weights + window.end_of_sparse, 0.0f);
  std::fill(patch->weights + window.end_of_sparse + num_rest, patch->weights + padded, 0.0f);
  for (int k = 0; k < padded; k += kLanes) {
    hn::Store(hn::Mul(hn::Load(df, patch->weights + k), hn::Load(df, samples + k)), df, patch->weighted + k);
  }
  ReferenceSums sparse = SumReference(*patch, samples, 0, window.end_of_sparse);
  sparse.weight += 1;  // the centre
  const ReferenceSums rest = SumReference(*patch, samples, window.end_of_sparse, padded);
  patch->sparse = MakeReference(sparse);
  patch->all = MakeReference({sparse.weight + rest.weight, sparse.sum + rest.sum, sparse.squares + rest.squares});
}

// A window's samples from `begin` to before `end`.
struct WindowPart {
  const SimdWindow& window;
  int begin, end;
};

// Sets, or adds to, the sums of a view.
template <bool kAdds>
HWY_INLINE void SumWindow(const WindowPart& part, const SimdSources& sources, int view, const SimdPatch& patch, SimdSums* sums) {
  const Floats df;
  const LocalWarps& warps = sums->warps;
  float* of_view = sums->of_view[view];
  const VF one = hn::Set(df, 1.0f);
  const VF wx = hn::Set(df, warps.wx[view]), wy = hn::Set(df, warps.wy[view]);
  const VF xx = hn::Set(df, warps.xx[view]), xy = hn::Set(df, warps.xy[view]);
  const VF yx = hn::Set(df, warps.yx[view]), yy = hn::Set(df, warps.yy[view]);
  const VF x_center = hn::Set(df, warps.x[view]), y_center = hn::Set(df, warps.y[view]);
  const std::int64_t row = static_cast<std::int64_t>(warps.row[view]), column = static_cast<std::int64_t>(warps.column[view]);
  const std::uint32_t* base = sources.origin[view] + (row * sources.stride[view] + column);
  const auto stride = hn::Set(Ints(), static_cast<std::int32_t>(sources.stride[view]));
  // Shifted by the centre's sample, the sums lose no digits: the centre itself bounds how far it is from the
  // mean.
  const float centre = kAdds ? of_view[3] : SampleAt(base, sources.stride[view], warps.x[view], warps.y[view]);
  const VF shift = hn::Set(df, centre);
  const float* HWY_RESTRICT dx_begin = part.window.dx.data();
  const float* HWY_RESTRICT dy_begin = part.window.dy.data();
  Totals sum, squares, products;
  for (int i = part.begin; i < part.end; i += kSimdChunk) {
    for (int p = 0; p < kParts; ++p) {
      const int k = i + p * kLanes;
      const VF dx = hn::LoadU(df, dx_begin + k), dy = hn::LoadU(df, dy_begin + k);
      const VF r = hn::Div(one, hn::MulAdd(wx, dx, hn::MulAdd(wy, dy, one)));
      const VF x = hn::MulAdd(hn::MulAdd(xx, dx, hn::Mul(xy, dy)), r, x_center);
      const VF y = hn::MulAdd(hn::MulAdd(yx, dx, hn::Mul(yy, dy)), r, y_center);
      const VF sample = hn::Sub(Sample(base, stride, PlaceInWindow(x), PlaceInWindow(y)), shift);
      const VF weighted = hn::Mul(hn::Load(df, patch.weights + k), sample);
      sum.part[p] = hn::Add(sum.part[p], weighted);
      squares.part[p] = hn::MulAdd(weighted, sample, squares.part[p]);
      products.part[p] = hn::MulAdd(sample, hn::Load(df, patch.weighted + k), products.part[p]);
    }
  }
  Join<kAdds>(sum, squares, products, of_view);
  of_view[3] = centre;
}

void SumSparse(const SimdWindow& window, const SimdSources& sources, const SimdPatch& patch, const PlaneAtPoint& plane, SimdSums* sums) {
  constexpr int kViews = static_cast<int>(hn::MaxLanes(Doubles()));
  sums->inside = 0;
  for (int first = 0; first < sources.num; first += kViews) {
    const std::uint64_t inside = MakeLocalWarps(sources, first, plane, window.radius, &sums->warps);
    for (int j = first; j < sources.num && j < first + kViews; ++j) {
      if ((inside >> (j - first) & 1u) == 0) continue;
      SumWindow<false>({window, 0, window.end_of_sparse}, sources, j, patch, sums);
      sums->inside |= 1u << j;
    }
  }
}

void AddOthers(const SimdWindow& window, const SimdSources& sources, const SimdPatch& patch, SimdSums* sums) {
  for (int j = 0; j < sources.num; ++j) {
    if ((sums->inside >> j & 1u) == 0) continue;
    SumWindow<true>({window, window.end_of_sparse, static_cast<int>(window.dx.size())}, sources, j, patch, sums);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace phi
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phi {

HWY_EXPORT(LoadPatch);
HWY_EXPORT(SumSparse);
HWY_EXPORT(AddOthers);

void LoadSimdPatch(const PackedImage& reference, const SimdWindow& window, float weight_decay, float u,
                   float v, SimdPatch* patch) {
  HWY_DYNAMIC_DISPATCH(LoadPatch)(reference, window, weight_decay, u, v, patch);
}

void SumSparseSamples(const SimdWindow& window, const SimdSources& sources, const SimdPatch& patch, const PlaneAtPoint& plane,
                      SimdSums* sums) {
  HWY_DYNAMIC_DISPATCH(SumSparse)(window, sources, patch, plane, sums);
}

void AddOtherSamples(const SimdWindow& window, const SimdSources& sources, const SimdPatch& patch, SimdSums* sums) {
  HWY_DYNAMIC_DISPATCH(AddOthers)(window, sources, patch, sums);
}

void CostsOfSums(const SimdReference& reference, const SimdSums& sums, int num_views, float* costs) {
  for (int j = 0; j < num_views; ++j) {
    costs[j] = kMaxCost;
    if (!reference.textured || (sums.inside >> j & 1u) == 0) continue;
    const float* of_view = sums.of_view[j];
    const float mean = of_view[0] * reference.inverse_weight;
    const float variance = of_view[1] * reference.inverse_weight - mean * mean;
    if (!(variance >= kMinVariance)) continue;
    const float covariance = of_view[2] * reference.inverse_weight - reference.mean * mean;
    costs[j] = std::clamp(1.0f - covariance * reference.inverse_deviation / std::sqrt(variance), 0.0f, kMaxCost);
  }
}

}  // namespace phi
#endif  // HWY_ONCE

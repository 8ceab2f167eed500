// Compiled once for each instruction set: foreach_target.h includes this file again.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "phi/cpu/simd_zncc.cc"
#include "phi/base/simd_targets.h"
#include "phi/cpu/simd_zncc.h"

#include <algorithm>
#include <cmath>

// highway.h must follow foreach_target.h.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace phi {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kSimdChunk>;
using Ints = hn::RebindToSigned<Floats>;
using Words = hn::RebindToUnsigned<Floats>;
using VF = hn::Vec<Floats>;

constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));
constexpr int kParts = kSimdChunk / kLanes;  // vectors in a chunk

// 16 running totals.
struct Totals {
  VF part[kParts];
  HWY_INLINE Totals() {
    for (VF& p : part) p = hn::Zero(Floats());
  }
};

// Four of the totals, or as many as there are lanes: lane k with lane k + 8, then with lane k + 4.
using Quarter = hn::CappedTag<float, 4>;
template <class D>
HWY_INLINE hn::Vec<Quarter> FoldToQuarter([[maybe_unused]] D d, hn::Vec<D> v) {
#if HWY_TARGET == HWY_SCALAR
  return v;
#else
  if constexpr (hn::MaxLanes(d) <= 4) {
    return v;
  } else {
    const hn::Half<D> half;
    return FoldToQuarter(half, hn::Add(hn::LowerHalf(half, v), hn::UpperHalf(half, v)));
  }
#endif
}
HWY_INLINE hn::Vec<Quarter> JoinToQuarter(const Totals& totals) {
  Totals joined = totals;
  for (int half = kParts / 2; half > 0; half /= 2) {
    for (int p = 0; p < half; ++p) joined.part[p] = hn::Add(joined.part[p], joined.part[p + half]);
  }
  return FoldToQuarter(Floats(), joined.part[0]);
}

// The sums of three totals, lane k with lane k + 8, then k + 4, k + 2, k + 1, to or onto to[0] to to[2].
template <bool kAdds>
HWY_INLINE void Join(const Totals& a, const Totals& b, const Totals& c, float* to) {
  const auto qa = JoinToQuarter(a), qb = JoinToQuarter(b), qc = JoinToQuarter(c);
#if HWY_TARGET == HWY_SCALAR
  const float joined[3] = {hn::GetLane(qa), hn::GetLane(qb), hn::GetLane(qc)};
  for (int k = 0; k < 3; ++k) to[k] = (kAdds ? to[k] : 0.0f) + joined[k];
#else
  constexpr Quarter d;
  const auto none = hn::Zero(d);
  const auto ab = hn::Add(hn::ConcatLowerLower(d, qb, qa), hn::ConcatUpperUpper(d, qb, qa));
  const auto c0 = hn::Add(hn::ConcatLowerLower(d, none, qc), hn::ConcatUpperUpper(d, none, qc));
  const auto joined = hn::Add(hn::ConcatEven(d, c0, ab), hn::ConcatOdd(d, c0, ab));
  hn::Store(kAdds ? hn::Add(hn::Load(d, to), joined) : joined, d, to);
#endif
}

// 2^x for x <= 0, to about a unit in the last place; 2^-126 below that.
HWY_INLINE VF Exp2(VF x) {
  const Floats df;
  const Ints di;
  x = hn::Max(x, hn::Set(df, -126.0f));
  const auto whole = hn::NearestInt(x);
  const VF f = hn::Sub(x, hn::ConvertTo(df, whole));  // [-0.5, 0.5]
  VF sum = hn::Set(df, 1.5403530e-4f);                // ln(2)^k / k!, k = 6 to 0
  for (const float factor : {1.3333558e-3f, 9.6181291e-3f, 5.5504109e-2f, 2.4022651e-1f, 6.9314718e-1f, 1.0f}) {
    sum = hn::MulAdd(sum, f, hn::Set(df, factor));
  }
  return hn::Mul(sum, hn::BitCast(df, hn::ShiftLeft<23>(hn::Add(whole, hn::Set(di, 127)))));
}

// Where a bilinear sample lies along an axis: after which element, and how far.
struct Place {
  hn::Vec<Ints> element;
  VF fraction;
};

// Of x >= 0.
HWY_INLINE Place PlaceOf(VF x) {
  const auto element = hn::ConvertTo(Ints(), x);
  return {element, hn::Sub(x, hn::ConvertTo(Floats(), element))};
}

// Of 0.5 <= x < 2^22, in half of the instructions: a conversion minds overflow. The sum lies where floats are whole numbers, and
// its low bits are one. A whole x may lie a fraction of 1 after the element before, which is the same sample.
HWY_INLINE Place PlaceInWindow(VF x) {
  constexpr float kWhole = 1 << 23;
  const Floats df;
  const Ints di;
  const VF sum = hn::Add(x, hn::Set(df, kWhole - 0.5f));
  return {hn::And(hn::BitCast(di, sum), hn::Set(di, (1 << 23) - 1)), hn::Sub(x, hn::Sub(sum, hn::Set(df, kWhole)))};
}

// Bilinear samples, of elements from `base`.
HWY_INLINE VF Sample(const std::uint32_t* HWY_RESTRICT base, hn::Vec<Ints> stride, const Place& x, const Place& y) {
  const Floats df;
  const Ints di;
  const Words dw;
  const VF fx = x.fraction, fy = y.fraction;
  const auto taps = hn::GatherIndex(dw, base, hn::Add(hn::Mul(y.element, stride), x.element));
  const auto byte = hn::Set(dw, 0xFF);
  const auto to_float = [&](hn::Vec<Words> v) HWY_ATTR { return hn::ConvertTo(df, hn::BitCast(di, v)); };
  const VF p00 = to_float(hn::And(taps, byte));
  const VF p10 = to_float(hn::And(hn::ShiftRight<8>(taps), byte));
  const VF p01 = to_float(hn::And(hn::ShiftRight<16>(taps), byte));
  const VF p11 = to_float(hn::ShiftRight<24>(taps));
  const VF top = hn::MulAdd(fx, hn::Sub(p10, p00), p00);
  const VF bottom = hn::MulAdd(fx, hn::Sub(p11, p01), p01);
  return hn::MulAdd(fy, hn::Sub(bottom, top), top);
}

HWY_INLINE float SampleAt(const std::uint32_t* base, std::int64_t stride, float x, float y) {
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float fx = x - column, fy = y - row;
  const std::uint32_t taps = base[row * stride + column];
  const float p00 = taps & 0xFF, p10 = taps >> 8 & 0xFF, p01 = taps >> 16 & 0xFF, p11 = taps >> 24;
  const float top = p00 + fx * (p10 - p00), bottom = p01 + fx * (p11 - p01);
  return top + fy * (bottom - top);
}

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

using Doubles = hn::ScalableTag<double>;
using VD = hn::Vec<Doubles>;

// The warps of the views from `first` on, as many as there are lanes. Returns a bit for each whose window lies inside the source
// image: no corner falls outside or behind it.
HWY_INLINE std::uint64_t MakeLocalWarps(const SimdSources& s, int first, const PlaneAtPoint& plane, float radius, LocalWarps* warps) {
  const Doubles dd;
  const hn::Rebind<float, Doubles> df;
  const auto set = [&](double value) HWY_ATTR { return hn::Set(dd, value); };
  const auto a = [&](int k) HWY_ATTR { return hn::Load(dd, s.a[k] + first); };
  const auto b = [&](int k) HWY_ATTR { return hn::Load(dd, s.b[k] + first); };
  const auto at_center = [&](int k) HWY_ATTR {
    return hn::MulAdd(a(3 * k), set(plane.u),
                      hn::MulAdd(a(3 * k + 1), set(plane.v), hn::MulAdd(b(k), set(plane.inverse_depth), a(3 * k + 2))));
  };
  const auto per_column = [&](int k) HWY_ATTR { return hn::MulAdd(b(k), set(plane.per_column), a(3 * k)); };
  const auto per_row = [&](int k) HWY_ATTR { return hn::MulAdd(b(k), set(plane.per_row), a(3 * k + 1)); };
  const VD hz = at_center(2), inverse = hn::Div(set(1), hz);
  const VD su = hn::Mul(at_center(0), inverse), sv = hn::Mul(at_center(1), inverse);
  const VD zx = per_column(2), zy = per_row(2);
  const auto single = [&](VD value) HWY_ATTR { return hn::DemoteTo(df, hn::Mul(value, inverse)); };
  const auto wx = single(zx), wy = single(zy);
  const auto xx = single(hn::NegMulAdd(su, zx, per_column(0))), xy = single(hn::NegMulAdd(su, zy, per_row(0)));
  const auto yx = single(hn::NegMulAdd(sv, zx, per_column(1))), yy = single(hn::NegMulAdd(sv, zy, per_row(1)));

  auto inside = hn::Gt(hz, set(0));
  auto x_min = hn::Zero(df), x_max = x_min, y_min = x_min, y_max = x_min;
  for (int corner = 0; corner < 4; ++corner) {
    const auto dx = hn::Set(df, corner & 1 ? radius : -radius), dy = hn::Set(df, corner & 2 ? radius : -radius);
    const auto w = hn::MulAdd(wx, dx, hn::MulAdd(wy, dy, hn::Set(df, 1.0f)));
    const auto r = hn::Div(hn::Set(df, 1.0f), w);
    const auto x = hn::Mul(hn::MulAdd(xx, dx, hn::Mul(xy, dy)), r), y = hn::Mul(hn::MulAdd(yx, dx, hn::Mul(yy, dy)), r);
    inside = hn::And(inside, hn::Gt(hn::PromoteTo(dd, w), set(0)));
    x_min = hn::Min(x_min, x);
    x_max = hn::Max(x_max, x);
    y_min = hn::Min(y_min, y);
    y_max = hn::Max(y_max, y);
  }
  const VD x = hn::Sub(su, set(0.5)), y = hn::Sub(sv, set(0.5));  // elements
  const VD left = hn::Add(x, hn::PromoteTo(dd, x_min)), top = hn::Add(y, hn::PromoteTo(dd, y_min));
  inside = hn::And(inside, hn::And(hn::Ge(left, set(0)), hn::Ge(top, set(0))));
  inside = hn::And(inside, hn::Le(hn::Add(x, hn::PromoteTo(dd, x_max)), hn::Load(dd, s.last_column + first)));
  inside = hn::And(inside, hn::Le(hn::Add(y, hn::PromoteTo(dd, y_max)), hn::Load(dd, s.last_row + first)));
  const VD column = hn::Sub(hn::Trunc(left), set(1)), row = hn::Sub(hn::Trunc(top), set(1));
  hn::Store(wx, df, warps->wx + first);
  hn::Store(wy, df, warps->wy + first);
  hn::Store(xx, df, warps->xx + first);
  hn::Store(xy, df, warps->xy + first);
  hn::Store(yx, df, warps->yx + first);
  hn::Store(yy, df, warps->yy + first);
  hn::Store(hn::DemoteTo(df, hn::Sub(x, column)), df, warps->x + first);
  hn::Store(hn::DemoteTo(df, hn::Sub(y, row)), df, warps->y + first);
  hn::Store(column, dd, warps->column + first);
  hn::Store(row, dd, warps->row + first);
  alignas(8) std::uint8_t bits[8] = {};
  hn::StoreMaskBits(dd, inside, bits);
  return bits[0];
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

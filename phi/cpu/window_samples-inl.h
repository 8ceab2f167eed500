// Vectors of a window's samples: bilinear samples of packed images, weights, and sums in one order whatever the vectors' length.
// Included once for each instruction set; see simd_zncc.cc.
#if defined(PHI_CPU_WINDOW_SAMPLES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PHI_CPU_WINDOW_SAMPLES_INL_H_
#undef PHI_CPU_WINDOW_SAMPLES_INL_H_
#else
#define PHI_CPU_WINDOW_SAMPLES_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "phi/cpu/simd_zncc.h"

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

}  // namespace HWY_NAMESPACE
}  // namespace phi
HWY_AFTER_NAMESPACE();

#endif  // include guard

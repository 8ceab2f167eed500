// Compiled once for each instruction set: foreach_target.h includes this file again.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "phi/cpu/simd_zncc.cc"
// SSSE3 and AVX3_DL gain nothing over SSE4 and AVX3 here; vectors without a fixed length cannot be array
// elements.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
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

// The sum of the totals: lane k with lane k + 8, then k + 4, k + 2, k + 1.
HWY_INLINE float Join(const Totals& totals) {
  alignas(64) float lane[kSimdChunk];
  for (int p = 0; p < kParts; ++p) hn::Store(totals.part[p], Floats(), lane + p * kLanes);
  for (int half = kSimdChunk / 2; half > 0; half /= 2) {
    for (int k = 0; k < half; ++k) lane[k] += lane[k + half];
  }
  return lane[0];
}

// Bilinear samples at (x, y) >= 0, in elements from `base`.
HWY_INLINE VF Sample(const std::uint32_t* HWY_RESTRICT base, hn::Vec<Ints> stride, VF x, VF y) {
  const Floats df;
  const Ints di;
  const Words dw;
  const auto column = hn::ConvertTo(di, x), row = hn::ConvertTo(di, y);
  const VF fx = hn::Sub(x, hn::ConvertTo(df, column)), fy = hn::Sub(y, hn::ConvertTo(df, row));
  const auto taps = hn::GatherIndex(dw, base, hn::Add(hn::Mul(row, stride), column));
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

float SampleAt(const std::uint32_t* base, std::int64_t stride, float x, float y) {
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float fx = x - column, fy = y - row;
  const std::uint32_t taps = base[row * stride + column];
  const float p00 = taps & 0xFF, p10 = taps >> 8 & 0xFF, p01 = taps >> 16 & 0xFF, p11 = taps >> 24;
  const float top = p00 + fx * (p10 - p00), bottom = p01 + fx * (p11 - p01);
  return top + fy * (bottom - top);
}

void LoadPatch(const PackedImage& reference, const SimdWindow& window, float weight_decay, float u, float v,
               SimdPatch* patch) {
  const Floats df;
  const VF x_last = hn::Set(df, static_cast<float>(reference.width() - 1));
  const VF y_last = hn::Set(df, static_cast<float>(reference.height() - 1));
  const VF x_center = hn::Set(df, u - 0.5f), y_center = hn::Set(df, v - 0.5f), zero = hn::Zero(df);
  const auto stride = hn::Set(Ints(), static_cast<std::int32_t>(reference.stride()));
  const int padded = static_cast<int>(window.dx.size());
  // The centre, clamped as all samples are: the padding repeats it and must not count in the sums.
  const float x_shift = std::clamp(u - 0.5f, 0.0f, static_cast<float>(reference.width() - 1));
  const float y_shift = std::clamp(v - 0.5f, 0.0f, static_cast<float>(reference.height() - 1));
  const VF shift = hn::Set(df, SampleAt(reference.origin(), reference.stride(), x_shift, y_shift));
  for (int k = 0; k < padded; k += kLanes) {
    const VF x = hn::Min(hn::Max(hn::Add(x_center, hn::LoadU(df, window.dx.data() + k)), zero), x_last);
    const VF y = hn::Min(hn::Max(hn::Add(y_center, hn::LoadU(df, window.dy.data() + k)), zero), y_last);
    hn::Store(hn::Sub(Sample(reference.origin(), stride, x, y), shift), df, patch->samples + k);
  }
  for (int k = 0; k < window.num_samples; ++k) {
    patch->weights[k] = std::exp2(-weight_decay * patch->samples[k] * patch->samples[k]);
  }
  std::fill(patch->weights + window.num_samples, patch->weights + padded, 0.0f);
  Totals weight, sum, squares;
  for (int i = 0; i < padded; i += kSimdChunk) {
    for (int p = 0; p < kParts; ++p) {
      const VF w = hn::Load(df, patch->weights + i + p * kLanes);
      const VF sample = hn::Load(df, patch->samples + i + p * kLanes), weighted = hn::Mul(w, sample);
      weight.part[p] = hn::Add(weight.part[p], w);
      sum.part[p] = hn::Add(sum.part[p], weighted);
      squares.part[p] = hn::MulAdd(weighted, sample, squares.part[p]);
    }
  }
  const float inverse = 1.0f / Join(weight);
  const float mean = Join(sum) * inverse;
  const float variance = Join(squares) * inverse - mean * mean;
  patch->textured = variance >= kMinVariance;
  if (!patch->textured) return;
  const VF inverses = hn::Set(df, inverse), means = hn::Set(df, mean);
  const VF inverse_deviation = hn::Set(df, 1.0f / std::sqrt(variance));
  for (int k = 0; k < padded; k += kLanes) {
    const VF w = hn::Mul(hn::Load(df, patch->weights + k), inverses);
    const VF sample = hn::Mul(hn::Sub(hn::Load(df, patch->samples + k), means), inverse_deviation);
    hn::Store(w, df, patch->weights + k);
    hn::Store(hn::Mul(w, sample), df, patch->samples + k);
  }
}

// The homography around the window's centre. With offsets (dx, dy) from the centre and w = 1 + wx dx + wy dy,
// the source's element is (x + (xx dx + xy dy) / w, y + (yx dx + yy dy) / w), counted from `base`.
struct LocalWarp {
  float wx, wy, xx, xy, yx, yy;
  float x, y;
  const std::uint32_t* base;
};

// False when a corner of the window falls outside the source image, or behind it.
HWY_INLINE bool MakeLocalWarp(const SimdSource& s, double u, double v, const PlaneAtPixel& plane,
                              float radius, LocalWarp* warp) {
  const double hx = s.a[0] * u + s.a[1] * v + s.a[2] + s.b[0] * plane.inverse_depth;
  const double hy = s.a[3] * u + s.a[4] * v + s.a[5] + s.b[1] * plane.inverse_depth;
  const double hz = s.a[6] * u + s.a[7] * v + s.a[8] + s.b[2] * plane.inverse_depth;
  if (!(hz > 0)) return false;
  const double inverse = 1.0 / hz, su = hx * inverse, sv = hy * inverse;
  const double zx = s.a[6] + s.b[2] * plane.per_column, zy = s.a[7] + s.b[2] * plane.per_row;
  warp->wx = static_cast<float>(zx * inverse);
  warp->wy = static_cast<float>(zy * inverse);
  warp->xx = static_cast<float>((s.a[0] + s.b[0] * plane.per_column - su * zx) * inverse);
  warp->xy = static_cast<float>((s.a[1] + s.b[0] * plane.per_row - su * zy) * inverse);
  warp->yx = static_cast<float>((s.a[3] + s.b[1] * plane.per_column - sv * zx) * inverse);
  warp->yy = static_cast<float>((s.a[4] + s.b[1] * plane.per_row - sv * zy) * inverse);

  float x_min = 0, x_max = 0, y_min = 0, y_max = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const float dx = corner & 1 ? radius : -radius, dy = corner & 2 ? radius : -radius;
    const float w = 1.0f + (warp->wx * dx + warp->wy * dy);
    if (!(w > 0)) return false;
    const float r = 1.0f / w;
    const float x = (warp->xx * dx + warp->xy * dy) * r, y = (warp->yx * dx + warp->yy * dy) * r;
    x_min = std::min(x_min, x);
    x_max = std::max(x_max, x);
    y_min = std::min(y_min, y);
    y_max = std::max(y_max, y);
  }
  const double x = su - 0.5, y = sv - 0.5;  // elements
  if (!(x + x_min >= 0 && y + y_min >= 0 && x + x_max <= s.width - 1 && y + y_max <= s.height - 1))
    return false;
  // From one element before the first: then positions are positive and truncation rounds down.
  const int column = static_cast<int>(x + x_min) - 1, row = static_cast<int>(y + y_min) - 1;
  warp->x = static_cast<float>(x - column);
  warp->y = static_cast<float>(y - row);
  warp->base = s.origin + (row * s.stride + column);
  return true;
}

float CostOfWindow(const SimdWindow& window, const SimdSource& source, const SimdPatch& patch,
                   const LocalWarp& warp) {
  const Floats df;
  const VF one = hn::Set(df, 1.0f);
  const VF wx = hn::Set(df, warp.wx), wy = hn::Set(df, warp.wy);
  const VF xx = hn::Set(df, warp.xx), xy = hn::Set(df, warp.xy);
  const VF yx = hn::Set(df, warp.yx), yy = hn::Set(df, warp.yy);
  const VF x_center = hn::Set(df, warp.x), y_center = hn::Set(df, warp.y);
  const auto stride = hn::Set(Ints(), static_cast<std::int32_t>(source.stride));
  // Shifted by the centre's sample, the sums lose no digits: the centre itself bounds how far it is from the
  // mean.
  const VF shift = hn::Set(df, SampleAt(warp.base, source.stride, warp.x, warp.y));
  const float* HWY_RESTRICT dx_begin = window.dx.data();
  const float* HWY_RESTRICT dy_begin = window.dy.data();
  const int padded = static_cast<int>(window.dx.size());
  Totals sum, squares, products;
  for (int i = 0; i < padded; i += kSimdChunk) {
    for (int p = 0; p < kParts; ++p) {
      const int k = i + p * kLanes;
      const VF dx = hn::LoadU(df, dx_begin + k), dy = hn::LoadU(df, dy_begin + k);
      const VF r = hn::Div(one, hn::MulAdd(wx, dx, hn::MulAdd(wy, dy, one)));
      const VF x = hn::MulAdd(hn::MulAdd(xx, dx, hn::Mul(xy, dy)), r, x_center);
      const VF y = hn::MulAdd(hn::MulAdd(yx, dx, hn::Mul(yy, dy)), r, y_center);
      const VF sample = hn::Sub(Sample(warp.base, stride, x, y), shift);
      const VF weighted = hn::Mul(hn::Load(df, patch.weights + k), sample);
      sum.part[p] = hn::Add(sum.part[p], weighted);
      squares.part[p] = hn::MulAdd(weighted, sample, squares.part[p]);
      products.part[p] = hn::MulAdd(sample, hn::Load(df, patch.samples + k), products.part[p]);
    }
  }
  const float mean = Join(sum);
  const float variance = Join(squares) - mean * mean;
  if (!(variance >= kMinVariance)) return kMaxCost;
  return std::clamp(1.0f - Join(products) / std::sqrt(variance), 0.0f, kMaxCost);
}

int Costs(const SimdWindow& window, std::span<const SimdSource> sources, const SimdPatch& patch, double u,
          double v, const PlaneAtPixel& plane, std::uint32_t wanted, float* costs) {
  int num_read = 0;
  LocalWarp warp;
  for (std::size_t j = 0; j < sources.size(); ++j) {
    if ((wanted >> j & 1u) == 0) continue;
    const bool is_inside = MakeLocalWarp(sources[j], u, v, plane, window.radius, &warp);
    costs[j] = is_inside ? CostOfWindow(window, sources[j], patch, warp) : kMaxCost;
    num_read += is_inside;
  }
  return num_read;
}

std::string TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace phi
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phi {

HWY_EXPORT(LoadPatch);
HWY_EXPORT(Costs);
HWY_EXPORT(TargetName);

SimdWindow::SimdWindow(const MatchingWindow& window, Samples samples) : radius(window.Radius()) {
  const int n = window.samples_per_side;
  for (int row = -n; row <= n; ++row) {
    for (int column = -n; column <= n; ++column) {
      if (samples == Samples::kSparse && !IsSparseSample(row, column)) continue;
      dx.push_back(static_cast<float>(column) * window.step);
      dy.push_back(static_cast<float>(row) * window.step);
    }
  }
  num_samples = static_cast<int>(dx.size());
  const std::size_t padded = (dx.size() + kSimdChunk - 1) / kSimdChunk * kSimdChunk;
  dx.resize(padded, 0.0f);
  dy.resize(padded, 0.0f);
}

SimdSource::SimdSource(const PackedImage& image, const RelativeView& view)
    : origin(image.origin()), stride(image.stride()), width(image.width()), height(image.height()) {
  std::copy(view.a.m, view.a.m + 9, a);
  b[0] = view.b.x;
  b[1] = view.b.y;
  b[2] = view.b.z;
}

void LoadSimdPatch(const PackedImage& reference, const SimdWindow& window, float weight_decay, float u,
                   float v, SimdPatch* patch) {
  HWY_DYNAMIC_DISPATCH(LoadPatch)(reference, window, weight_decay, u, v, patch);
}

int SimdZnccCosts(const SimdWindow& window, std::span<const SimdSource> sources, const SimdPatch& patch,
                  double u, double v, const PlaneAtPixel& plane, std::uint32_t wanted, float* costs) {
  if (patch.textured) return HWY_DYNAMIC_DISPATCH(Costs)(window, sources, patch, u, v, plane, wanted, costs);
  for (std::size_t j = 0; j < sources.size(); ++j) {
    if (wanted >> j & 1u) costs[j] = kMaxCost;
  }
  return 0;
}

std::string SimdTargetName() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace phi
#endif  // HWY_ONCE

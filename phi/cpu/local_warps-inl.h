// Where a plane takes a window in the source images: several views at once, in double precision.
// Included once for each instruction set; see simd_zncc.cc.
#if defined(PHI_CPU_LOCAL_WARPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PHI_CPU_LOCAL_WARPS_INL_H_
#undef PHI_CPU_LOCAL_WARPS_INL_H_
#else
#define PHI_CPU_LOCAL_WARPS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "phi/cpu/simd_zncc.h"

HWY_BEFORE_NAMESPACE();
namespace phi {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

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

}  // namespace HWY_NAMESPACE
}  // namespace phi
HWY_AFTER_NAMESPACE();

#endif  // include guard

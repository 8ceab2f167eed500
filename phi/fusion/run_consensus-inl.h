// Where the images that agree with the pixels of a run put the surface: the median of their depths, and the sums over
// those near it.
// Included once for each instruction set; see support_run.cc.
#if defined(PHI_FUSION_RUN_CONSENSUS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PHI_FUSION_RUN_CONSENSUS_INL_H_
#undef PHI_FUSION_RUN_CONSENSUS_INL_H_
#else
#define PHI_FUSION_RUN_CONSENSUS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <limits>
#include <vector>

#include "phi/fusion/run_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace phi {
namespace HWY_NAMESPACE {

// Sorts the agreeing images' relative depths, per pixel, and returns the medians.
HWY_INLINE VF Median(const FusionGates& gates, int first, SupportRun* run) {
  const Floats df;
  const Ints di;
  const VF infinity = Set(std::numeric_limits<float>::infinity());
  const VI most = hn::Set(di, gates.max_num_views);
  VI count = hn::Set(di, 1);
  Store(hn::Zero(df), run->sorted[0].value + first);  // the reference
  std::size_t num_sorted = 1;
  for (const std::uint32_t k : run->agreeing) {
    RunAnswer& answer = run->answers[k];
    const Mask space = hn::RebindMask(df, hn::Lt(count, most));
    const Mask taken = hn::And(FromBits(answer.agrees, first), space);
    answer.agrees &= ~ToBits(hn::Not(taken), first);
    count = hn::Sub(count, hn::BitCast(di, hn::VecFromMask(df, taken)));
    VF value = hn::IfThenElse(taken, Load(answer.relative_depth + first), infinity);
    // What is larger moves up, from the place where the value belongs in any pixel.
    for (std::size_t i = 0; i < num_sorted; ++i) {
      const VF other = Load(run->sorted[i].value + first);
      Store(hn::Min(value, other), run->sorted[i].value + first);
      value = hn::Max(value, other);
    }
    Store(value, run->sorted[num_sorted++].value + first);
  }
  hn::Store(count, di, run->num_agreeing + first);
  const VI lane = hn::Iota(di, first);
  const auto at = [&](VI rank) HWY_ATTR {
    return hn::GatherIndex(df, run->sorted[0].value, hn::Add(hn::Mul(rank, hn::Set(di, kRunLength)), lane));
  };
  const VF lower = at(hn::ShiftRight<1>(hn::Sub(count, hn::Set(di, 1)))),
           upper = at(hn::ShiftRight<1>(count));
  return hn::Mul(Set(0.5f), hn::Add(lower, upper));
}

// Sums over the images that agree with the consensus.
struct Sums {
  VF support, least_cosine;
  Vectors3 normal;
  VI num_views, num_inferred, red, green, blue, brightness_squares;
};

HWY_INLINE Sums ZeroSums() {
  const VF f = hn::Zero(Floats());
  const VI i = hn::Zero(Ints());
  return {f, Set(1), {f, f, f}, i, i, i, i, i, i};
}

// As phi::CosineOfRays.
HWY_INLINE VF CosineOfRays(const Vectors3& point, const FusionNeighbor& neighbor) {
  const Vec3f& center = neighbor.center;
  const Vectors3 theirs = {hn::Sub(point.x, Set(center.x)), hn::Sub(point.y, Set(center.y)), hn::Sub(point.z, Set(center.z))};
  return hn::Div(Dot(point, theirs), hn::Sqrt(hn::Mul(Dot(point, point), Dot(theirs, theirs))));
}

// Drops the image where it is outside the tolerance around the median (both over the reference depth), and adds it elsewhere. Returns
// where it is added.
HWY_INLINE Mask AddView(VF median, VF tolerance, int first, bool is_reference, RunAnswer* answer,
                        Sums* sums) {
  const Floats df;
  const Ints di;
  const VF relative_depth = Load(answer->relative_depth + first), agreement = Load(answer->agreement + first);
  const VF near = SoftAgreement(hn::Abs(hn::Sub(relative_depth, median)), tolerance);
  const Mask kept = hn::And(FromBits(answer->agrees, first), hn::Gt(near, hn::Zero(df)));
  answer->agrees &= ~ToBits(hn::Not(kept), first);
  const auto add = [&](VF value, VF* sum) HWY_ATTR { *sum = hn::Add(*sum, hn::IfThenElseZero(kept, value)); };
  if (!is_reference) add(hn::Mul(near, agreement), &sums->support);
  add(hn::Mul(agreement, Load(answer->normal[0] + first)), &sums->normal.x);
  add(hn::Mul(agreement, Load(answer->normal[1] + first)), &sums->normal.y);
  add(hn::Mul(agreement, Load(answer->normal[2] + first)), &sums->normal.z);

  const Words dw;
  const VW color = hn::IfThenElseZero(hn::RebindMask(dw, kept), hn::Load(dw, answer->color + first));
  const auto bits_of = [&](VW bits, std::uint32_t mask) HWY_ATTR { return hn::BitCast(di, hn::And(bits, hn::Set(dw, mask))); };
  const VI red = bits_of(color, 0xFF), green = bits_of(hn::ShiftRight<8>(color), 0xFF),
           blue = bits_of(hn::ShiftRight<16>(color), 0xFF), brightness = hn::Add(hn::Add(red, green), blue);
  sums->red = hn::Add(sums->red, red);
  sums->green = hn::Add(sums->green, green);
  sums->blue = hn::Add(sums->blue, blue);
  sums->brightness_squares = hn::Add(sums->brightness_squares, hn::Mul(brightness, brightness));
  static_assert(FusionPixel::kInferred == 1);
  sums->num_inferred = hn::Add(sums->num_inferred, bits_of(hn::ShiftRight<24>(color), FusionPixel::kInferred));
  sums->num_views = hn::Sub(sums->num_views, hn::BitCast(di, hn::VecFromMask(df, kept)));
  return kept;
}

HWY_INLINE void FindConsensus(const std::vector<FusionNeighbor>& neighbors, const FusionGates& gates, const ReferenceRun& reference,
                              int first, SupportRun* run) {
  const Ints di;
  const VF median = Median(gates, first, run), tolerance = Set(gates.max_depth_error);
  Sums sums = ZeroSums();
  AddView(median, tolerance, first, true, &run->reference, &sums);
  const VF depth = hn::Mul(Load(reference.depth + first), hn::Add(Set(1), median));
  const Vectors3 point = {hn::Mul(depth, Load(reference.ray_x + first)), hn::Mul(depth, Set(reference.ray_y)), depth};
  for (const std::uint32_t k : run->agreeing) {
    const Mask kept = AddView(median, tolerance, first, false, &run->answers[k], &sums);
    const VF cosine = hn::IfThenElse(kept, CosineOfRays(point, neighbors[k]), sums.least_cosine);
    sums.least_cosine = hn::Min(cosine, sums.least_cosine);
  }
  Store(median, run->relative_depth + first);
  Store(sums.support, run->support + first);
  Store(sums.least_cosine, run->least_cosine + first);
  Store(sums.normal.x, run->normal_sum[0] + first);
  Store(sums.normal.y, run->normal_sum[1] + first);
  Store(sums.normal.z, run->normal_sum[2] + first);
  hn::Store(sums.num_views, di, run->num_views + first);
  hn::Store(sums.num_inferred, di, run->num_inferred + first);
  hn::Store(sums.red, di, run->rgb_sum[0] + first);
  hn::Store(sums.green, di, run->rgb_sum[1] + first);
  hn::Store(sums.blue, di, run->rgb_sum[2] + first);
  hn::Store(sums.brightness_squares, di, run->brightness_squares + first);
}

}  // namespace HWY_NAMESPACE
}  // namespace phi
HWY_AFTER_NAMESPACE();

#endif  // include guard

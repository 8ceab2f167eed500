// Compiled once for each instruction set: foreach_target.h includes this file again.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "phi/fusion/support_run.cc"
// SSSE3 and AVX3_DL gain nothing over SSE4 and AVX3 here; vectors without a fixed length cannot be array
// elements.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include "phi/fusion/support_run.h"

#include <algorithm>
#include <cstring>
#include <limits>

// highway.h must follow foreach_target.h.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/cache_control.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace phi {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kRunLength>;
using Ints = hn::RebindToSigned<Floats>;
using Words = hn::RebindToUnsigned<Floats>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;
using VW = hn::Vec<Words>;
using Mask = hn::Mask<Floats>;

constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));

HWY_INLINE VF Set(float value) { return hn::Set(Floats(), value); }
HWY_INLINE VF Load(const float* lanes) { return hn::Load(Floats(), lanes); }
HWY_INLINE void Store(VF v, float* lanes) { hn::Store(v, Floats(), lanes); }

HWY_INLINE Mask FromBits(RunBits bits, int part) {
  const std::uint64_t shifted = bits >> part;
  std::uint8_t bytes[8];
  std::memcpy(bytes, &shifted, sizeof(bytes));
  return hn::LoadMaskBits(Floats(), bytes);
}

HWY_INLINE RunBits ToBits(Mask mask, int part) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(Floats(), mask, bytes);
  RunBits bits;
  std::memcpy(&bits, bytes, sizeof(bits));
  constexpr RunBits kAll = (RunBits{1} << kLanes) - 1;
  return (bits & kAll) << part;
}

// Adds 1 where the mask holds.
HWY_INLINE void Count(Mask mask, std::int32_t* counts) {
  const Ints di;
  hn::Store(hn::Sub(hn::Load(di, counts), hn::BitCast(di, hn::VecFromMask(Floats(), mask))), di, counts);
}

struct Vectors3 {
  VF x, y, z;
};

HWY_INLINE VF Dot(const Vectors3& a, const Vectors3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

// a * x + b.
HWY_INLINE Vectors3 ScaleAndAdd(VF a, const Vectors3& x, const Vec3f& b) {
  return {hn::Add(hn::Mul(a, x.x), Set(b.x)), hn::Add(hn::Mul(a, x.y), Set(b.y)),
          hn::Add(hn::Mul(a, x.z), Set(b.z))};
}

HWY_INLINE VF RowTimes(float a, float b, float c, const Vectors3& v) {
  return Dot({Set(a), Set(b), Set(c)}, v);
}

HWY_INLINE Vectors3 Rotate(const Mat3f& r, const Vectors3& v) {
  return {RowTimes(r.m[0], r.m[1], r.m[2], v), RowTimes(r.m[3], r.m[4], r.m[5], v),
          RowTimes(r.m[6], r.m[7], r.m[8], v)};
}

HWY_INLINE Vectors3 RotateBack(const Mat3f& r, const Vectors3& v) {
  return {RowTimes(r.m[0], r.m[3], r.m[6], v), RowTimes(r.m[1], r.m[4], r.m[7], v),
          RowTimes(r.m[2], r.m[5], r.m[8], v)};
}

// As phi::UnpackNormal.
HWY_INLINE Vectors3 Unpack(VW packed) {
  const Floats df;
  const VI bits = hn::BitCast(Ints(), packed);
  const VF unit = Set(1.0f / 32767.0f), zero = hn::Zero(df);
  VF x = hn::Mul(hn::ConvertTo(df, hn::ShiftRight<16>(hn::ShiftLeft<16>(bits))), unit);
  VF y = hn::Mul(hn::ConvertTo(df, hn::ShiftRight<16>(bits)), unit);
  const VF z = hn::Sub(hn::Sub(Set(1), hn::Abs(x)), hn::Abs(y));
  const VF fold = hn::IfThenElseZero(hn::Lt(z, zero), hn::Neg(z));
  x = hn::Add(x, hn::IfThenElse(hn::Ge(x, zero), hn::Neg(fold), fold));
  y = hn::Add(y, hn::IfThenElse(hn::Ge(y, zero), hn::Neg(fold), fold));
  const Vectors3 n = {x, y, z};
  const VF scale = hn::Div(Set(1), hn::Sqrt(Dot(n, n)));
  return {hn::Mul(scale, x), hn::Mul(scale, y), hn::Mul(scale, z)};
}

// 1 at no error, 0 at the gate and beyond; smooth, so that a small change of a map changes the support little.
HWY_INLINE VF SoftAgreement(VF error, float gate) {
  const VF r = hn::Div(error, Set(gate));
  return hn::IfThenElseZero(hn::Lt(r, Set(1)), hn::Sub(Set(1), hn::Mul(r, r)));
}

struct Projection {
  VF u, v;
};

HWY_INLINE Projection Project(const RayModel& k, const Vectors3& x) {
  const VF inverse_z = hn::Div(Set(1), x.z);
  return {hn::Add(hn::Mul(hn::Mul(Set(k.fx), x.x), inverse_z), Set(k.cx)),
          hn::Add(hn::Mul(hn::Mul(Set(k.fy), x.y), inverse_z), Set(k.cy))};
}

HWY_INLINE Mask Inside(const RayModel& k, const Vectors3& x, const Projection& p) {
  const VF zero = hn::Zero(Floats());
  const Mask right = hn::And(hn::Ge(p.u, zero), hn::Lt(p.u, Set(static_cast<float>(k.width))));
  const Mask below = hn::And(hn::Ge(p.v, zero), hn::Lt(p.v, Set(static_cast<float>(k.height))));
  return hn::And(hn::Gt(x.z, zero), hn::And(right, below));
}

// The part of the run that one vector holds.
struct Part {
  const ReferenceRun* reference;
  int first;
  VF depth;
  Vectors3 normal;
};

HWY_INLINE Part MakePart(const ReferenceRun& reference, int first) {
  return {&reference, first, Load(reference.depth + first),
          Unpack(hn::Load(Words(), reference.normal + first))};
}

// Gathers wait for memory most of the time. The run after the next falls about as far from this one's end as this one
// is long, twice; a wrong guess costs time only.
HWY_INLINE void PrefetchAhead(const FusionNeighbor& neighbor, const Projection& seen) {
  constexpr int kStep = 4;  // pixels: 48 bytes of a map
  alignas(64) float u[kLanes], v[kLanes];
  Store(seen.u, u);
  Store(seen.v, v);
  constexpr float kDistance = 2.0f * kRunLength / std::max(1, kLanes - 1);
  const float du = kDistance * (u[kLanes - 1] - u[0]), dv = kDistance * (v[kLanes - 1] - v[0]);
  for (int i = 0; i < kLanes; i += kStep) {
    const float ahead_u = u[i] + du, ahead_v = v[i] + dv;
    if (!(ahead_u >= 0 && ahead_v >= 0 && ahead_u < neighbor.view.source.width &&
          ahead_v < neighbor.view.source.height))
      continue;
    hwy::Prefetch(&neighbor.map(static_cast<int>(ahead_u), static_cast<int>(ahead_v)));
  }
}

HWY_INLINE void StoreNormal(const Vectors3& normal, int first, RunAnswer* answer) {
  Store(normal.x, answer->normal[0] + first);
  Store(normal.y, answer->normal[1] + first);
  Store(normal.z, answer->normal[2] + first);
}

// What a neighbour's map holds where the points fall.
struct Sighting {
  Vectors3 direction;  // of the reference rays, in the neighbour's frame
  Vectors3 point;      // in the neighbour's frame
  Projection seen;
  Mask inside;
  VI column, row, index;  // index: of the pixel's first word
  VF depth;
};

// Without depths yet.
HWY_INLINE Sighting Sight(const FusionNeighbor& neighbor, const Part& part, Mask wanted) {
  const Ints di;
  const RayModel& k = neighbor.view.source;
  const float* r = neighbor.view.rotation.m;
  const VF ray_x = Load(part.reference->ray_x + part.first), ray_y = Set(part.reference->ray_y);
  const auto along_ray = [&](float a, float b, float c) HWY_ATTR {
    return hn::Add(hn::Add(hn::Mul(Set(a), ray_x), hn::Mul(Set(b), ray_y)), Set(c));
  };
  Sighting s;
  s.direction = {along_ray(r[0], r[1], r[2]), along_ray(r[3], r[4], r[5]), along_ray(r[6], r[7], r[8])};
  s.point = ScaleAndAdd(part.depth, s.direction, neighbor.view.translation);
  s.seen = Project(k, s.point);
  s.inside = hn::And(wanted, Inside(k, s.point, s.seen));
  s.column = hn::ConvertTo(di, s.seen.u);
  s.row = hn::ConvertTo(di, s.seen.v);
  const VI pixel = hn::Add(hn::Mul(s.row, hn::Set(di, k.width)), s.column);
  const VI word = hn::Mul(pixel, hn::Set(di, FusionPixel::kNumWords));
  s.index = hn::IfThenElseZero(hn::RebindMask(di, s.inside), word);
  return s;
}

// The neighbour's planes, met by the reference rays.
struct Meeting {
  Vectors3 normal;  // in the neighbour's frame
  VF relative_depth, reproj_error;
  Mask meets;
};

HWY_INLINE Meeting Meet(const FusionNeighbor& neighbor, const FusionGates& gates, const Part& part,
                        const Sighting& s, const std::uint32_t* words) {
  const Floats df;
  const RayModel& k = neighbor.view.source;
  const Vec3f& t = neighbor.view.translation;
  Meeting m;
  m.normal = Unpack(hn::GatherIndex(Words(), words + FusionPixel::kNormalWord, s.index));
  const VF slope = Dot(m.normal, s.direction);
  const auto pixel_ray = [&](VI i, float center, float inverse_f) HWY_ATTR {
    return hn::Mul(hn::Sub(hn::Add(hn::ConvertTo(df, i), Set(0.5f)), Set(center)), Set(inverse_f));
  };
  const Vectors3 offset = {
      hn::Sub(hn::Mul(s.depth, pixel_ray(s.column, k.cx, neighbor.inverse_fx)), Set(t.x)),
      hn::Sub(hn::Mul(s.depth, pixel_ray(s.row, k.cy, neighbor.inverse_fy)), Set(t.y)),
      hn::Sub(s.depth, Set(t.z))};
  const VF along = hn::Div(Dot(m.normal, offset), slope);
  m.relative_depth = hn::Sub(hn::Div(along, part.depth), Set(1));
  const Vectors3 y = ScaleAndAdd(along, s.direction, t);
  m.meets = hn::And(hn::And(hn::Lt(slope, Set(-kMinRayCosine)), hn::Gt(y.z, hn::Zero(df))),
                    hn::Le(hn::Abs(m.relative_depth), Set(kCoverFactor * gates.max_depth_error)));
  const Projection agreed = Project(k, y);
  const VF du = hn::Sub(agreed.u, s.seen.u), dv = hn::Sub(agreed.v, s.seen.v);
  m.reproj_error = hn::Sqrt(hn::Add(hn::Mul(du, du), hn::Mul(dv, dv)));
  return m;
}

// Whether the neighbour samples the surface finely enough to stand for the reference's pixels. A pixel's longest step
// along the surface is depth / (focal length * slant cosine); the reference's normal serves both sides, so that noise in
// normals matters little.
HWY_INLINE Mask SamplesFinely(const FusionNeighbor& neighbor, const Part& part, const Sighting& s) {
  const Vectors3 ray = {Load(part.reference->ray_x + part.first), Set(part.reference->ray_y), Set(1)};
  const Vectors3 normal = Rotate(neighbor.view.rotation, part.normal);
  const VF slant = hn::Max(Set(kMinSlantCosine), hn::Neg(Dot(part.normal, ray)));
  const VF their_slant = hn::Max(Set(kMinSlantCosine), hn::Neg(hn::Div(Dot(normal, s.point), s.point.z)));
  return hn::Le(hn::Mul(hn::Mul(s.depth, Set(part.reference->fx)), slant),
                hn::Mul(hn::Mul(Set(kMaxCoarsening * neighbor.view.source.fx), part.depth), their_slant));
}

// Which of the pixels `compared` the neighbour covers, if it is an earlier one.
HWY_INLINE Mask FindCovered(const FusionNeighbor& neighbor, const FusionGates& gates, const Part& part,
                            const Sighting& s, VF reproj_error, VW color, Mask compared) {
  const Mask close = hn::Le(reproj_error, Set(kCoverFactor * gates.max_reproj_error));
  const VW flag = hn::Set(Words(), std::uint32_t{FusionPixel::kEmitted} << 24);
  const Mask emitted = hn::RebindMask(Floats(), hn::TestBit(color, flag));
  const Mask candidates = hn::And(compared, hn::And(close, emitted));
  return hn::And(candidates, SamplesFinely(neighbor, part, s));
}

// Asks the neighbour about the pixels `wanted`; see neighbor_lookup.h. Returns those that it covers.
HWY_INLINE Mask Ask(const FusionNeighbor& neighbor, const FusionGates& gates, const Part& part, Mask wanted,
                    SupportRun* run, RunAnswer* answer) {
  const Floats df;
  const Mask none = hn::MaskFromVec(hn::Zero(df));
  Sighting s = Sight(neighbor, part, wanted);
  if (hn::AllFalse(df, s.inside)) return none;
  PrefetchAhead(neighbor, s.seen);
  const std::uint32_t* words = reinterpret_cast<const std::uint32_t*>(neighbor.map.data);
  s.depth = hn::BitCast(df, hn::GatherIndex(Words(), words, s.index));
  const Mask has_depth = hn::And(s.inside, hn::Gt(s.depth, hn::Zero(df)));
  const VF difference = hn::Sub(s.depth, s.point.z);
  const auto tolerances = [&](float factor)
                              HWY_ATTR { return hn::Mul(Set(factor * gates.max_depth_error), s.point.z); };
  const Mask beyond = hn::Gt(difference, tolerances(kSeenThroughFactor));
  const Mask near = hn::AndNot(hn::Gt(hn::Abs(difference), tolerances(kHopelessFactor)), has_depth);
  const int first = part.first;
  if (hn::AllFalse(df, near)) {
    Count(has_depth, run->num_depth + first);
    Count(hn::And(has_depth, beyond), run->num_seen_through + first);
    return none;
  }

  const Meeting m = Meet(neighbor, gates, part, s, words);
  const Mask compared = hn::And(near, m.meets);
  const Mask depth_agrees = hn::And(compared, hn::Le(hn::Abs(m.relative_depth), Set(gates.max_depth_error)));
  const Mask reproj_agrees = hn::And(depth_agrees, hn::Le(m.reproj_error, Set(gates.max_reproj_error)));
  const VF cosine = Dot(Rotate(neighbor.view.rotation, part.normal), m.normal);
  const Mask agrees = hn::And(reproj_agrees, hn::Ge(cosine, Set(gates.min_normal_cosine)));
  Count(hn::AndNot(depth_agrees, has_depth), run->num_depth + first);
  Count(hn::And(hn::AndNot(compared, has_depth), beyond), run->num_seen_through + first);
  Count(hn::AndNot(reproj_agrees, depth_agrees), run->num_reprojection + first);
  Count(hn::AndNot(agrees, reproj_agrees), run->num_normal + first);

  const VW color = hn::GatherIndex(Words(), words + FusionPixel::kColorWord, s.index);
  const VF agreement = hn::Mul(SoftAgreement(m.reproj_error, gates.max_reproj_error),
                               SoftAgreement(hn::Sub(Set(1), cosine), 1 - gates.min_normal_cosine));
  answer->agrees |= ToBits(agrees, first);
  Store(m.relative_depth, answer->relative_depth + first);
  Store(agreement, answer->agreement + first);
  StoreNormal(RotateBack(neighbor.view.rotation, m.normal), first, answer);
  hn::Store(color, Words(), answer->color + first);
  return neighbor.earlier ? FindCovered(neighbor, gates, part, s, m.reproj_error, color, compared) : none;
}

// Asks the neighbour about the run's pixels `wanted`; returns those that it covers.
HWY_INLINE RunBits AskRun(const FusionNeighbor& neighbor, const FusionGates& gates, const Part* parts,
                          RunBits wanted, SupportRun* run, RunAnswer* answer) {
  RunBits covered = 0;
  for (int first = 0, i = 0; first < kRunLength; first += kLanes, ++i) {
    const Mask mask = FromBits(wanted, first);
    if (hn::AllFalse(Floats(), mask)) continue;
    covered |= ToBits(Ask(neighbor, gates, parts[i], mask, run, answer), first);
  }
  return covered;
}

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
  VF weight, weighted_depth, support;
  Vectors3 normal;
  VI num_views, num_inferred, red, green, blue;
};

HWY_INLINE Sums ZeroSums() {
  const VF f = hn::Zero(Floats());
  const VI i = hn::Zero(Ints());
  return {f, f, f, {f, f, f}, i, i, i, i, i};
}

// Drops the image where it is outside the depth tolerance around the median, and adds it elsewhere.
HWY_INLINE void AddView(const FusionGates& gates, int first, VF median, bool is_reference, RunAnswer* answer,
                        Sums* sums) {
  // A measurement that only just passes the reprojection or normal gate still says something about depth.
  constexpr float kLeastWeight = 0.1f;
  const Floats df;
  const Ints di;
  const VF relative_depth = Load(answer->relative_depth + first), agreement = Load(answer->agreement + first);
  const VF near = SoftAgreement(hn::Abs(hn::Sub(relative_depth, median)), gates.max_depth_error);
  const Mask kept = hn::And(FromBits(answer->agrees, first), hn::Gt(near, hn::Zero(df)));
  answer->agrees &= ~ToBits(hn::Not(kept), first);
  const auto add = [&](VF value, VF* sum) HWY_ATTR { *sum = hn::Add(*sum, hn::IfThenElseZero(kept, value)); };
  const VF weight = hn::Mul(near, hn::Add(Set(kLeastWeight), agreement));
  add(weight, &sums->weight);
  add(hn::Mul(weight, relative_depth), &sums->weighted_depth);
  if (!is_reference) add(hn::Mul(near, agreement), &sums->support);
  add(hn::Mul(agreement, Load(answer->normal[0] + first)), &sums->normal.x);
  add(hn::Mul(agreement, Load(answer->normal[1] + first)), &sums->normal.y);
  add(hn::Mul(agreement, Load(answer->normal[2] + first)), &sums->normal.z);

  const Words dw;
  const VW color = hn::IfThenElseZero(hn::RebindMask(dw, kept), hn::Load(dw, answer->color + first));
  const auto add_bits = [&](VW bits, std::uint32_t mask, VI* sum) HWY_ATTR {
    *sum = hn::Add(*sum, hn::BitCast(di, hn::And(bits, hn::Set(dw, mask))));
  };
  add_bits(color, 0xFF, &sums->red);
  add_bits(hn::ShiftRight<8>(color), 0xFF, &sums->green);
  add_bits(hn::ShiftRight<16>(color), 0xFF, &sums->blue);
  static_assert(FusionPixel::kInferred == 1);
  add_bits(hn::ShiftRight<24>(color), FusionPixel::kInferred, &sums->num_inferred);
  sums->num_views = hn::Sub(sums->num_views, hn::BitCast(di, hn::VecFromMask(df, kept)));
}

HWY_INLINE void FindConsensus(const FusionGates& gates, int first, SupportRun* run) {
  const Floats df;
  const Ints di;
  const VF median = Median(gates, first, run);
  Sums sums = ZeroSums();
  AddView(gates, first, median, true, &run->reference, &sums);
  for (const std::uint32_t k : run->agreeing) AddView(gates, first, median, false, &run->answers[k], &sums);
  const VF mean = hn::Div(sums.weighted_depth, sums.weight);
  Store(hn::IfThenElse(hn::Gt(sums.weight, hn::Zero(df)), mean, median), run->relative_depth + first);
  Store(sums.support, run->support + first);
  Store(sums.normal.x, run->normal_sum[0] + first);
  Store(sums.normal.y, run->normal_sum[1] + first);
  Store(sums.normal.z, run->normal_sum[2] + first);
  hn::Store(sums.num_views, di, run->num_views + first);
  hn::Store(sums.num_inferred, di, run->num_inferred + first);
  hn::Store(sums.red, di, run->rgb_sum[0] + first);
  hn::Store(sums.green, di, run->rgb_sum[1] + first);
  hn::Store(sums.blue, di, run->rgb_sum[2] + first);
}

HWY_INLINE void StartRun(const ReferenceRun& reference, Part* parts, SupportRun* run) {
  const VI zero = hn::Zero(Ints());
  run->has_depth = run->covered = 0;
  for (int first = 0, i = 0; first < kRunLength; first += kLanes, ++i) {
    const Part& part = parts[i];
    run->has_depth |= ToBits(hn::Gt(part.depth, hn::Zero(Floats())), first);
    for (std::int32_t* counts :
         {run->num_depth, run->num_reprojection, run->num_normal, run->num_seen_through})
      hn::Store(zero, Ints(), counts + first);
    RunAnswer& own = run->reference;
    Store(hn::Zero(Floats()), own.relative_depth + first);
    Store(Set(1), own.agreement + first);
    StoreNormal(part.normal, first, &own);
    hn::Store(hn::Load(Words(), reference.color + first), Words(), own.color + first);
  }
  for (RunAnswer& answer : run->answers) answer.agrees = 0;
}

// Covered pixels need no more answers.
HWY_INLINE RunBits AskAll(const std::vector<FusionNeighbor>& neighbors, const FusionGates& gates,
                          const Part* parts, SupportRun* run) {
  RunBits open = run->has_depth;
  for (std::size_t i = 0; i < run->earlier.size() && open != 0; ++i) {
    const std::uint32_t k = run->earlier[i];
    const RunBits covered = AskRun(neighbors[k], gates, parts, open, run, &run->answers[k]);
    if (covered == 0) continue;
    open &= ~covered;
    const auto place = run->earlier.begin() + static_cast<std::ptrdiff_t>(i);
    std::rotate(run->earlier.begin(), place, place + 1);
  }
  for (std::size_t k = run->earlier.size(); k < neighbors.size() && open != 0; ++k)
    AskRun(neighbors[k], gates, parts, open, run, &run->answers[k]);
  return open;
}

void Decide(const std::vector<FusionNeighbor>& neighbors, const FusionGates& gates,
            const ReferenceRun& reference, SupportRun* run) {
  Part parts[kRunLength / kLanes];
  for (int first = 0, i = 0; first < kRunLength; first += kLanes, ++i) parts[i] = MakePart(reference, first);
  StartRun(reference, parts, run);
  const RunBits open = AskAll(neighbors, gates, parts, run);
  run->covered = run->has_depth & ~open;
  if (open == 0) return;
  run->agreeing.clear();
  for (std::uint32_t k = 0; k < neighbors.size(); ++k) {
    run->answers[k].agrees &= open;
    if (run->answers[k].agrees != 0) run->agreeing.push_back(k);
  }
  run->reference.agrees = open;
  for (int first = 0; first < kRunLength; first += kLanes) {
    if (!hn::AllFalse(Floats(), FromBits(open, first))) FindConsensus(gates, first, run);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace phi
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phi {

HWY_EXPORT(Decide);

SupportRun::SupportRun(const std::vector<FusionNeighbor>& neighbors)
    : answers(neighbors.size()), sorted(neighbors.size() + 1) {
  for (std::uint32_t k = 0; k < neighbors.size(); ++k) {
    if (neighbors[k].earlier) earlier.push_back(k);
  }
}

void DecideRun(const std::vector<FusionNeighbor>& neighbors, const FusionGates& gates,
               const ReferenceRun& reference, SupportRun* run) {
  HWY_DYNAMIC_DISPATCH(Decide)(neighbors, gates, reference, run);
}

}  // namespace phi
#endif  // HWY_ONCE

// What a neighbouring image answers about the pixels of a run: its plane against the reference rays, and whether a point
// of its own covers them. neighbor_lookup.h tells the order of the tests.
// Included once for each instruction set; see support_run.cc.
#if defined(PHI_FUSION_NEIGHBOR_ANSWERS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PHI_FUSION_NEIGHBOR_ANSWERS_INL_H_
#undef PHI_FUSION_NEIGHBOR_ANSWERS_INL_H_
#else
#define PHI_FUSION_NEIGHBOR_ANSWERS_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "phi/fusion/run_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace phi {
namespace HWY_NAMESPACE {

// The part of the run that one vector holds.
struct Part {
  const ReferenceRun* reference;
  int first;
  VF depth;
  Vectors3 normal;
  HWY_INLINE Part() {}
  HWY_INLINE Part(const ReferenceRun& run, int first)
      : reference(&run), first(first), depth(Load(run.depth + first)), normal(Unpack(hn::Load(Words(), run.normal + first))) {}
};

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
struct Lookup {
  Vectors3 direction;  // of the reference rays, in the neighbour's frame
  Vectors3 point;      // in the neighbour's frame
  Projection seen;
  Mask inside;
  VI column, row, index;  // index: of the pixel's first word
  VF depth;
  HWY_INLINE Lookup() {}
};

// Without depths yet.
HWY_INLINE Lookup LookUp(const FusionNeighbor& neighbor, const Part& part, Mask wanted) {
  const Ints di;
  const RayModel& k = neighbor.view.source;
  const float* r = neighbor.view.rotation.m;
  const VF ray_x = Load(part.reference->ray_x + part.first), ray_y = Set(part.reference->ray_y);
  const auto along_ray = [&](float a, float b, float c) HWY_ATTR {
    return hn::Add(hn::Add(hn::Mul(Set(a), ray_x), hn::Mul(Set(b), ray_y)), Set(c));
  };
  Lookup s;
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
struct Intersection {
  Vectors3 normal;  // in the neighbour's frame
  VF relative_depth, reproj_error;
  Mask meets;
  HWY_INLINE Intersection() {}
};

HWY_INLINE Intersection Intersect(const FusionNeighbor& neighbor, const FusionGates& gates, const Part& part,
                        const Lookup& s, const std::uint32_t* words) {
  const Floats df;
  const RayModel& k = neighbor.view.source;
  const Vec3f& t = neighbor.view.translation;
  Intersection m;
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
  m.meets = hn::And(hn::And(hn::Lt(slope, Set(-gates.min_ray_cosine)), hn::Gt(y.z, hn::Zero(df))),
                    hn::Le(hn::Abs(m.relative_depth), Set(gates.cover_factor * gates.max_depth_error)));
  const Projection agreed = Project(k, y);
  const VF du = hn::Sub(agreed.u, s.seen.u), dv = hn::Sub(agreed.v, s.seen.v);
  m.reproj_error = hn::Sqrt(hn::Add(hn::Mul(du, du), hn::Mul(dv, dv)));
  return m;
}

// Whether the neighbour samples the surface finely enough to stand for the reference's pixels. A pixel's longest step
// along the surface is depth / (focal length * slant cosine); the reference's normal serves both sides, so that noise in
// normals matters little.
HWY_INLINE Mask SamplesFinely(const FusionNeighbor& neighbor, const FusionGates& gates, const Part& part,
                              const Lookup& s) {
  const Vectors3 ray = {Load(part.reference->ray_x + part.first), Set(part.reference->ray_y), Set(1)};
  const Vectors3 normal = Rotate(neighbor.view.rotation, part.normal);
  const VF slant = hn::Max(Set(gates.min_slant_cosine), hn::Neg(Dot(part.normal, ray)));
  const VF their_slant =
      hn::Max(Set(gates.min_slant_cosine), hn::Neg(hn::Div(Dot(normal, s.point), s.point.z)));
  return hn::Le(
      hn::Mul(hn::Mul(s.depth, Set(part.reference->fx)), slant),
      hn::Mul(hn::Mul(Set(gates.max_coarsening * neighbor.view.source.fx), part.depth), their_slant));
}

// Which of the pixels `meeting`, whose surface the neighbour's meets, it covers, if it is an earlier one.
HWY_INLINE Mask FindCovered(const FusionNeighbor& neighbor, const FusionGates& gates, const Part& part,
                            const Lookup& s, VW color, Mask meeting) {
  const Mask candidates = hn::And(meeting, HasFlag(color, FusionPixel::kEmitted));
  if (hn::AllFalse(Floats(), candidates)) return candidates;
  return hn::And(candidates, SamplesFinely(neighbor, gates, part, s));
}

// Counts the neighbour among those that see through the pixels `beyond` where it measured a surface. An inferred one behind
// a point is more often wrong than the point before it.
HWY_INLINE void CountSeenThrough(VW color, Mask beyond, int first, SupportRun* run) {
  Count(hn::AndNot(HasFlag(color, FusionPixel::kInferred), beyond), run->num_seen_through + first);
}

// Asks the neighbour about the pixels `wanted`; see neighbor_lookup.h. Returns those that it covers.
HWY_INLINE Mask Ask(const FusionNeighbor& neighbor, const FusionGates& gates, const Part& part, Mask wanted,
                    SupportRun* run, RunAnswer* answer) {
  const Floats df;
  const Mask none = hn::MaskFromVec(hn::Zero(df));
  Lookup s = LookUp(neighbor, part, wanted);
  if (hn::AllFalse(df, s.inside)) return none;
  PrefetchAhead(neighbor, s.seen);
  const std::uint32_t* words = reinterpret_cast<const std::uint32_t*>(neighbor.map.data);
  s.depth = hn::BitCast(df, hn::GatherIndex(Words(), words, s.index));
  const Mask has_depth = hn::And(s.inside, hn::Gt(s.depth, hn::Zero(df)));
  const VF difference = hn::Sub(s.depth, s.point.z);
  const auto tolerances = [&](float factor)
                              HWY_ATTR { return hn::Mul(Set(factor * gates.max_depth_error), s.point.z); };
  const VF apart = tolerances(gates.seen_through_factor);
  const Mask beyond = hn::Gt(difference, apart), before = hn::Lt(difference, hn::Neg(apart));
  const Mask near = hn::AndNot(hn::Gt(hn::Abs(difference), tolerances(gates.hopeless_factor)), has_depth);
  const int first = part.first;
  if (neighbor.stands_apart) Count(hn::AndNot(has_depth, s.inside), run->num_without_depth + first);
  const auto gather_color = [&]() HWY_ATTR {
    return hn::GatherIndex(Words(), words + FusionPixel::kColorWord, s.index);
  };
  if (hn::AllFalse(df, near)) {
    if (!neighbor.stands_apart) return none;
    Count(has_depth, run->num_depth + first);
    Count(hn::And(has_depth, before), run->num_hidden + first);
    const Mask behind = hn::And(has_depth, beyond);
    if (!hn::AllFalse(df, behind)) CountSeenThrough(gather_color(), behind, first, run);
    return none;
  }

  const Intersection m = Intersect(neighbor, gates, part, s, words);
  const Mask compared = hn::And(near, m.meets);
  const VW color = gather_color();
  const Mask close = hn::Le(m.reproj_error, Set(gates.max_reproj_error));
  const Mask covered =
      neighbor.earlier ? FindCovered(neighbor, gates, part, s, color, hn::And(compared, close)) : none;
  if (!neighbor.stands_apart || hn::AllFalse(df, hn::AndNot(covered, has_depth)))
    return covered;  // nothing else matters of these pixels

  const Mask depth_agrees = hn::And(compared, hn::Le(hn::Abs(m.relative_depth), Set(gates.max_depth_error)));
  const Mask reproj_agrees = hn::And(depth_agrees, close);
  const VF cosine = Dot(Rotate(neighbor.view.rotation, part.normal), m.normal);
  const Mask agrees = hn::And(reproj_agrees, hn::Ge(cosine, Set(gates.min_normal_cosine)));
  Count(hn::AndNot(depth_agrees, has_depth), run->num_depth + first);
  const Mask elsewhere = hn::AndNot(compared, has_depth);
  CountSeenThrough(color, hn::And(elsewhere, beyond), first, run);
  Count(hn::And(elsewhere, before), run->num_hidden + first);
  Count(hn::AndNot(reproj_agrees, depth_agrees), run->num_reprojection + first);
  Count(hn::AndNot(agrees, reproj_agrees), run->num_normal + first);

  const VF agreement = hn::Mul(SoftAgreement(m.reproj_error, Set(gates.max_reproj_error)),
                               SoftAgreement(hn::Sub(Set(1), cosine), Set(1 - gates.min_normal_cosine)));
  answer->agrees |= ToBits(agrees, first);
  Store(m.relative_depth, answer->relative_depth + first);
  Store(agreement, answer->agreement + first);
  StoreNormal(RotateBack(neighbor.view.rotation, m.normal), first, answer);
  hn::Store(color, Words(), answer->color + first);
  return covered;
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

}  // namespace HWY_NAMESPACE
}  // namespace phi
HWY_AFTER_NAMESPACE();

#endif  // include guard

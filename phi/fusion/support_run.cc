// Compiled once for each instruction set: foreach_target.h includes this file again.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "phi/fusion/support_run.cc"
#include "phi/base/simd_targets.h"
#include "phi/fusion/support_run.h"

#include <algorithm>

// foreach_target.h must come before what it compiles again.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "phi/fusion/neighbor_answers-inl.h"
#include "phi/fusion/run_consensus-inl.h"
#include "phi/fusion/run_vectors-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace phi {
namespace HWY_NAMESPACE {

HWY_INLINE void StartRun(const ReferenceRun& reference, Part* parts, SupportRun* run) {
  const VI zero = hn::Zero(Ints());
  run->has_depth = run->covered = 0;
  for (int first = 0, i = 0; first < kRunLength; first += kLanes, ++i) {
    const Part& part = parts[i];
    run->has_depth |= ToBits(hn::Gt(part.depth, hn::Zero(Floats())), first);
    for (std::int32_t* counts :
         {run->num_without_depth, run->num_depth, run->num_reprojection, run->num_normal, run->num_seen_through, run->num_hidden})
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
  for (int first = 0, i = 0; first < kRunLength; first += kLanes, ++i) parts[i] = Part(reference, first);
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
    if (!hn::AllFalse(Floats(), FromBits(open, first))) FindConsensus(neighbors, gates, reference, first, run);
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

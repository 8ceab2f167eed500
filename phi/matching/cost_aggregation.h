// From one cost per source view to one cost per pixel.
//
// paper:  Eq. 5, the harmonic mean over the views that see the window.
// robust: joint view selection. A view's weight at a pixel follows from how well the neighbouring hypotheses match in it, and
//         from whether the neighbouring pixels use it; the cost is the weighted mean. Inferred hypotheses, which have no such
//         history, cost what the paper's do.
#pragma once

#include <cstdint>

#include "phi/base/hd.h"
#include "phi/matching/zncc.h"

namespace phi {

inline constexpr int kMaxSourceViews = 32;  // one bit each in the mask of selected views

// Eq. 5 with omega = 1. C_j is floored so that one view near 0 cannot win alone. No valid view: kMaxCost.
PHI_HD float HarmonicMeanCost(const float* costs, int num_views) {
  constexpr float kFloor = 1e-3f;
  int n = 0;
  float sum = 0;
  for (int j = 0; j < num_views; ++j) {
    if (costs[j] >= kMaxCost) continue;
    ++n;
    sum += 1.0f / fmaxf(costs[j], kFloor);
  }
  return n > 0 ? n / sum : kMaxCost;
}

PHI_HD float WeightedMeanCost(const float* costs, const float* weights, int num_views) {
  float sum = 0, total = 0;
  for (int j = 0; j < num_views; ++j) {
    sum += weights[j] * costs[j];
    total += weights[j];
  }
  return total > 0 ? sum / total : kMaxCost;
}

// Evidence that one view sees this pixel, from the costs of several hypotheses in that view.
struct ViewEvidence {
  int good = 0, bad = 0;
  float support = 0;

  // tau: cost below which a match counts as good.
  PHI_HD void Add(float cost, float tau) {
    constexpr float kSigma = 0.3f, kBad = 1.2f;
    if (cost < tau) {
      ++good;
      support += expf(-cost * cost / (2 * kSigma * kSigma));
    } else if (cost > kBad) {
      ++bad;
    }
  }

  PHI_HD float Weight(float tau) const {
    constexpr float kSigma = 0.3f;
    constexpr int kMinGood = 2, kMaxBad = 2;
    if (bad > kMaxBad) return 0;
    return good >= kMinGood ? support / good : expf(-tau * tau / (2 * kSigma * kSigma));
  }
};

// The threshold for a good match falls as the hypotheses improve.
PHI_HD float GoodCostThreshold(int iteration) {
  return 0.8f * expf(-static_cast<float>(iteration) * iteration / 90.0f);
}

// Weight factor of a view from the masks of selected views of the four neighbours.
PHI_HD float NeighbourPrior(const std::uint32_t* masks, int num_masks, int view) {
  constexpr float kSelected = 0.9f, kNotSelected = 0.1f;
  float prior = 0;
  for (int i = 0; i < num_masks; ++i) prior += (masks[i] >> view) & 1u ? kSelected : kNotSelected;
  return num_masks > 0 ? prior / num_masks : 1.0f;
}

// Drops views whose weight is a small share of the total; returns the mask of those that stay.
PHI_HD std::uint32_t PruneWeights(float* weights, int num_views) {
  constexpr float kSmallestShare = 1.0f / 15.0f;
  float total = 0;
  for (int j = 0; j < num_views; ++j) total += weights[j];
  std::uint32_t mask = 0;
  for (int j = 0; j < num_views; ++j) {
    if (weights[j] > kSmallestShare * total) {
      mask |= 1u << j;
    } else {
      weights[j] = 0;
    }
  }
  return mask;
}

inline constexpr int kNumBestViews = 3;

// Before any neighbour is known: the mean of the best three views, which become the selected ones. A view that does not see
// the window counts as the worst match; the weights of the first iteration take this cost's place.
PHI_HD float BestViewsCost(const float* costs, int num_views, std::uint32_t* mask) {
  *mask = 0;
  float sum = 0;
  int n = 0;
  for (; n < kNumBestViews && n < num_views; ++n) {
    int best = -1;
    for (int j = 0; j < num_views; ++j) {
      if ((*mask >> j) & 1u) continue;
      if (best < 0 || costs[j] < costs[best]) best = j;
    }
    *mask |= 1u << best;
    sum += costs[best];
  }
  return n > 0 ? sum / n : kMaxCost;
}

}  // namespace phi

// From one cost per source view to one cost per pixel: Eq. 5 with omega = 1, the harmonic mean over the views that see the window.
// Weights of views by how well the neighbouring pixels match in them were tried and lost (docs/development/rules.md).
#pragma once

#include "phi/base/hd.h"
#include "phi/matching/zncc.h"

namespace phi {

inline constexpr int kMaxSourceViews = 32;

class HarmonicMean {
 public:
  // Floored so that one view near 0 cannot win alone. kMaxCost: the view does not see the window.
  PHI_HD void Add(float cost) {
    constexpr float kFloor = 1e-3f;
    if (cost >= kMaxCost) return;
    ++num_views_;
    sum_ += 1.0f / Max(cost, kFloor);
  }

  // No view: kMaxCost.
  PHI_HD float Value() const { return num_views_ > 0 ? num_views_ / sum_ : kMaxCost; }

 private:
  int num_views_ = 0;
  float sum_ = 0;
};

PHI_HD float HarmonicMeanCost(const float* costs, int num_views) {
  HarmonicMean mean;
  for (int j = 0; j < num_views; ++j) mean.Add(costs[j]);
  return mean.Value();
}

}  // namespace phi

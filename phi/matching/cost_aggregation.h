// From one cost per source view to one cost per pixel: a power mean over the views that see the window. Weights of views by how well
// the neighbouring pixels match in them were tried and lost (docs/development/notes/ablations_small_images.md).
#pragma once

#include <cstdint>

#include "phi/base/cube_root.h"
#include "phi/base/hd.h"
#include "phi/matching/zncc.h"
#include "phi/options.h"

namespace phi {

inline constexpr int kMaxSourceViews = 32;

enum class ViewMean : std::uint8_t {
  kHarmonic,  // exponent -1: Eq. 5 with omega = 1
  kCubic,     // exponent -3: views that match well have more say, and those that see something else less
};

// Of the estimation. Much in a reduced image is as thin as a window, which then matches what lies behind it in some view or other.
inline ViewMean ChooseViewMean(const Method& method, bool is_reduced) {
  const bool is_cubic = method.FormulasOf(Rule::kViewMean) == Formulas::kRobust && !is_reduced;
  return is_cubic ? ViewMean::kCubic : ViewMean::kHarmonic;
}

class CostOfViews {
 public:
  PHI_HD explicit CostOfViews(ViewMean mean) : mean_(mean) {}

  // Floored so that one view near 0 cannot win alone. kMaxCost: the view does not see the window.
  PHI_HD void Add(float cost) {
    constexpr float kFloor = 1e-3f;
    if (cost >= kMaxCost) return;
    ++num_views_;
    const float inverse = 1.0f / Max(cost, kFloor);
    sum_ += mean_ == ViewMean::kCubic ? inverse * inverse * inverse : inverse;
  }

  // No view: kMaxCost.
  PHI_HD float Value() const {
    if (num_views_ == 0) return kMaxCost;
    const float mean = num_views_ / sum_;
    return mean_ == ViewMean::kCubic ? CubeRoot(mean) : mean;
  }

 private:
  ViewMean mean_;
  int num_views_ = 0;
  float sum_ = 0;
};

PHI_HD float CombineCosts(const float* costs, int num_views, ViewMean mean) {
  CostOfViews combined(mean);
  for (int j = 0; j < num_views; ++j) combined.Add(costs[j]);
  return combined.Value();
}

}  // namespace phi

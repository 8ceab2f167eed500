// The four hypothesis maps of an image.
#pragma once

#include <array>

#include "phi/backend.h"
#include "phi/inference/upsample.h"

namespace phi {

class Hypotheses {
 public:
  Hypotheses(const PlaneMap& measured, Formulas formulas);

  bool measured(int x, int y) const { return measured_inverse_depth_(x, y) > 0; }
  HypothesisMaps maps() const;

 private:
  Array2D<float> measured_inverse_depth_;
  std::array<Array2D<float>, kNumDirections> inverse_depth_;
};

}  // namespace phi

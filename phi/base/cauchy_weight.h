// Cauchy's weight, by which least squares are robust.
#pragma once

namespace phi {

// Of a residual, in units of the one that counts half.
inline double CauchyWeight(double residual) { return 1 / (1 + residual * residual); }

}  // namespace phi

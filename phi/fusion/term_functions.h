// Logarithms, angles and probabilities of many points. The C library's take 10 ns each and differ in the last bit from processor to
// processor; these are inlined and made of operations that are the same IEEE ones everywhere. Errors as measured over all
// arguments that terms have (term_functions_test.cc).
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace phi {

// c[0] + c[1] x + c[2] x^2 + ...
template <std::size_t kSize>
inline float Polynomial(const float (&c)[kSize], float x) {
  float sum = c[kSize - 1];
  for (std::size_t i = kSize - 1; i-- > 0;) sum = sum * x + c[i];
  return sum;
}

// log2 of a positive normal number, to within 1e-6; of powers of two exact.
inline float Log2(float x) {
  constexpr std::uint32_t kRootOfHalf = 0x3f3504f3u;
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
  const std::int32_t exponent = static_cast<std::int32_t>(bits - kRootOfHalf) >> 23;
  const float m =
      std::bit_cast<float>(bits - (static_cast<std::uint32_t>(exponent) << 23));  // in [sqrt(1/2), sqrt(2))
  // log(m) = 2 artanh(s) = 2 (s + s^3 / 3 + s^5 / 5 + ...)
  constexpr float k = static_cast<float>(2 / std::numbers::ln2);
  constexpr float kSeries[] = {k, k / 3, k / 5, k / 7, k / 9};
  const float s = (m - 1) / (m + 1);
  return static_cast<float>(exponent) + s * Polynomial(kSeries, s * s);
}

// The angle whose cosine this is, to within 3e-5 degrees, and 1e-6 of itself + 0.3 degrees. Cosines beyond [-1, 1] by rounding count as
// -1 and 1. Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.46.
inline float DegreesOfCosine(float cosine) {
  constexpr float kSeries[] = {1.5707963050f, -0.2145988016f, 0.0889789874f, -0.0501743046f,
                               0.0308918810f, -0.0170881256f, 0.0066700901f, -0.0012624911f};
  const float size = std::abs(cosine), c = size < 1 ? size : 1;
  const float angle = std::sqrt(1 - c) * Polynomial(kSeries, c);
  constexpr float kPi = std::numbers::pi_v<float>;
  return (cosine < 0 ? kPi - angle : angle) * (180 / kPi);
}

// 1 / (1 + exp(-x)), to within 2e-7. Beyond kMostLogOdds it overflows.
inline constexpr float kMostLogOdds = 80;
inline float Logistic(float x) {
  const float exponent = -x * std::numbers::log2e_v<float>;
  constexpr int kShift = 128;  // so that the conversion, which goes towards 0, rounds to the nearest
  const int whole = static_cast<int>(exponent + (kShift + 0.5f)) - kShift;
  const float rest = (exponent - static_cast<float>(whole)) * std::numbers::ln2_v<float>;
  constexpr float kSeries[] = {1, 1, 1.0f / 2, 1.0f / 6, 1.0f / 24, 1.0f / 120, 1.0f / 720};
  const float power = std::bit_cast<float>(static_cast<std::uint32_t>(whole + 127) << 23);
  return 1 / (1 + power * Polynomial(kSeries, rest));
}

}  // namespace phi

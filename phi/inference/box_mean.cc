#include "phi/inference/box_mean.h"

#include <cstdint>

namespace phi {
namespace {

constexpr int kSide = 5, kReach = kSide / 2;

}  // namespace

std::optional<BoxMean> MeanAround(const GrayImage& image, float u, float v) {
  const float x = u - 0.5f, y = v - 0.5f;
  if (!(x >= kReach && y >= kReach && x < static_cast<float>(image.width() - kReach - 1) &&
        y < static_cast<float>(image.height() - kReach - 1)))
    return std::nullopt;
  const int left = static_cast<int>(x) - kReach, top = static_cast<int>(y) - kReach;
  const float right_part = x - static_cast<float>(left + kReach), bottom_part = y - static_cast<float>(top + kReach);
  BoxMean sum;
  for (int j = 0; j <= kSide; ++j) {
    const std::uint8_t* row = &image(left, top + j);
    int inner = 0;
    for (int i = 1; i < kSide; ++i) inner += row[i];
    const float of_row = (1 - right_part) * row[0] + static_cast<float>(inner) + right_part * row[kSide];
    const float part = j == 0 ? 1 - bottom_part : j == kSide ? bottom_part : 1;
    sum.value += part * of_row;
    sum.du += part * (static_cast<float>(row[kSide]) - static_cast<float>(row[0]));
    if (j == 0) sum.dv -= of_row;
    if (j == kSide) sum.dv += of_row;
  }
  constexpr float kScale = 1.0f / (kSide * kSide);
  return BoxMean{kScale * sum.value, kScale * sum.du, kScale * sum.dv};
}

}  // namespace phi

#include "phi/geometry/image_correction.h"

#include <algorithm>
#include <cmath>

namespace phi {
namespace {

constexpr int kGridColumns = 12, kGridRows = 8;

template <typename Visit>
void ForEachGridPoint(int width, int height, const Visit& visit) {
  for (int j = 0; j < kGridRows; ++j) {
    for (int i = 0; i < kGridColumns; ++i)
      visit((i + 0.5) / kGridColumns * width, (j + 0.5) / kGridRows * height);
  }
}

}  // namespace

ImageCorrection::ImageCorrection(const Pinhole& model_pinhole)
    : width_(model_pinhole.width), height_(model_pinhole.height) {}

ImageCorrection::Terms ImageCorrection::TermsAt(double u, double v) const {
  const double scale = 2.0 / std::max(width_, height_);
  const double x = (u - 0.5 * width_) * scale, y = (v - 0.5 * height_) * scale;
  return (Terms() << 1, y, y * y, x, x * y, x * x).finished();
}

Eigen::Vector2d ImageCorrection::Offset(double u, double v) const {
  const Row row = RowAt(v);
  return {row.OffsetU(u), row.OffsetV(u)};
}

ImageCorrection::Row ImageCorrection::RowAt(double v) const {
  const double scale = 2.0 / std::max(width_, height_), y = (v - 0.5 * height_) * scale;
  const auto of_row = [&](int column) -> std::array<double, 3> {
    const auto c = coefficients.col(column);
    return {c[0] + y * (c[1] + y * c[2]), c[3] + y * c[4], c[5]};
  };
  return {of_row(0), of_row(1), 0.5 * width_, scale};
}

double ImageCorrection::MeanOffset() const {
  double sum = 0;
  ForEachGridPoint(width_, height_, [&](double u, double v) { sum += Offset(u, v).squaredNorm(); });
  return std::sqrt(sum / (kGridColumns * kGridRows));
}

double ImageCorrection::LargestOffset() const {
  double largest = 0;
  ForEachGridPoint(width_, height_,
                   [&](double u, double v) { largest = std::max(largest, Offset(u, v).norm()); });
  return largest;
}

}  // namespace phi

#include "colmap_ext/colorize.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace colmap_ext {
namespace {

constexpr int kGap = 6;  // pixels between two pictures

// The 256 colours of one of OpenCV's maps.
std::vector<Rgb> Palette(int opencv_color_map) {
  cv::Mat levels(1, 256, CV_8UC1), colors;
  for (int i = 0; i < 256; ++i) levels.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
  cv::applyColorMap(levels, colors, opencv_color_map);
  std::vector<Rgb> palette(256);
  for (int i = 0; i < 256; ++i) {
    const cv::Vec3b& bgr = colors.at<cv::Vec3b>(0, i);
    palette[i] = {bgr[2], bgr[1], bgr[0]};
  }
  return palette;
}

// 0 to 255 for low to high.
int Level(float value, const ValueRange& range) {
  const float span = std::max(range.high - range.low, 1e-12f);
  return static_cast<int>(std::lround(255 * std::clamp((value - range.low) / span, 0.0f, 1.0f)));
}

std::uint8_t SignedLevel(float value) {
  return static_cast<std::uint8_t>(std::lround(127.5f * (std::clamp(value, -1.0f, 1.0f) + 1)));
}

}  // namespace

ValueRange RobustRange(const phi::Array2D<float>& values) {
  std::vector<float> valid;
  for (const float v : values) {
    if (std::isfinite(v) && v > 0) valid.push_back(v);
  }
  if (valid.empty()) return {};
  const auto percentile = [&](double share) {
    const auto at =
        valid.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(valid.size() - 1));
    std::nth_element(valid.begin(), at, valid.end());
    return *at;
  };
  return {percentile(0.02), percentile(0.98)};
}

ColorImage ColorizeDepth(const phi::Array2D<float>& depth, const ValueRange& range) {
  const std::vector<Rgb> palette = Palette(cv::COLORMAP_TURBO);
  ColorImage picture(depth.width(), depth.height(), Rgb{});
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const float d = depth.data()[i];
    if (std::isfinite(d) && d > 0) picture.data()[i] = palette[255 - Level(d, range)];
  }
  return picture;
}

ColorImage ColorizeNormals(const phi::Array2D<phi::Vec3f>& normals) {
  ColorImage picture(normals.width(), normals.height(), Rgb{});
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const phi::Vec3f& n = normals.data()[i];
    if (!(phi::Dot(n, n) > 0)) continue;
    picture.data()[i] = {SignedLevel(n.x), SignedLevel(-n.y), SignedLevel(-n.z)};
  }
  return picture;
}

ColorImage ColorizeCost(const phi::Array2D<float>& cost, const ValueRange& range) {
  const std::vector<Rgb> palette = Palette(cv::COLORMAP_VIRIDIS);
  ColorImage picture(cost.width(), cost.height(), Rgb{});
  for (std::size_t i = 0; i < cost.size(); ++i) {
    if (std::isfinite(cost.data()[i])) picture.data()[i] = palette[Level(cost.data()[i], range)];
  }
  return picture;
}

ColorImage ColorizeConfidence(const phi::Array2D<float>& confidence) {
  const std::vector<Rgb> palette = Palette(cv::COLORMAP_VIRIDIS);
  ColorImage picture(confidence.width(), confidence.height(), Rgb{});
  for (std::size_t i = 0; i < confidence.size(); ++i) {
    if (confidence.data()[i] > 0) picture.data()[i] = palette[Level(confidence.data()[i], {0, 1})];
  }
  return picture;
}

ColorImage SideBySide(const ColorImage& left, const ColorImage& right) {
  const int height = std::max(left.height(), right.height());
  ColorImage both(left.width() + kGap + right.width(), height, Rgb{255, 255, 255});
  const auto paste = [&](const ColorImage& picture, int x0) {
    for (int y = 0; y < picture.height(); ++y) {
      std::copy_n(&picture(0, y), picture.width(), &both(x0, y));
    }
  };
  paste(left, 0);
  paste(right, left.width() + kGap);
  return both;
}

}  // namespace colmap_ext

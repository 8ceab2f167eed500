#include "colmap_ext/synthetic/sensor.h"

#include <cmath>
#include <cstring>

#include <tbb/parallel_for.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "phi/base/vec.h"

namespace colmap_ext {
namespace {

constexpr double kTwoPi = 6.283185307179586;

std::uint8_t Quantize(float value) {
  return static_cast<std::uint8_t>(std::lround(phi::Clamp(value, 0, 255)));
}

}  // namespace

std::array<double, 2> GaussianPair(phi::RandomKey key, std::uint64_t index) {
  const phi::Random4 words = phi::Philox(key, index, 0, 0);
  const double radius = std::sqrt(-2 * std::log(1.0 - phi::UniformFloat(words.v[0])));
  const double angle = kTwoPi * phi::UniformFloat(words.v[1]);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

ColorImage Develop(const phi::Array2D<Radiance>& radiance, const SensorOptions& options) {
  const int width = radiance.width(), height = radiance.height();
  const float gain = static_cast<float>(options.gain), sigma = static_cast<float>(options.noise_sigma);
  ColorImage image(width, height);
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const std::uint64_t pixel = static_cast<std::uint64_t>(y) * width + x;
      const float noise = sigma * static_cast<float>(GaussianPair(options.key, pixel)[0]);
      for (int c = 0; c < 3; ++c) image(x, y)[c] = Quantize(gain * radiance(x, y)[c] + noise);
    }
  });
  return image;
}

phi::GrayImage ToGray(const ColorImage& image) {
  phi::GrayImage gray(image.width(), image.height());
  for (std::size_t i = 0; i < image.size(); ++i) {
    const Rgb& c = image.data()[i];
    gray.data()[i] = Quantize(0.299f * c[0] + 0.587f * c[1] + 0.114f * c[2]);
  }
  return gray;
}

std::vector<std::uint8_t> EncodeImage(const ColorImage& image, int jpeg_quality) {
  const cv::Mat rgb(image.height(), image.width(), CV_8UC3, const_cast<Rgb*>(image.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<std::uint8_t> file;
  if (jpeg_quality == 0) {
    cv::imencode(".png", bgr, file);
  } else {
    cv::imencode(".jpg", bgr, file, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality});
  }
  return file;
}

phi::GrayImage DecodeGray(const std::vector<std::uint8_t>& file) {
  const cv::Mat decoded = cv::imdecode(file, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  phi::GrayImage gray(decoded.cols, decoded.rows);
  for (int y = 0; y < decoded.rows; ++y) std::memcpy(&gray(0, y), decoded.ptr(y), decoded.cols);
  return gray;
}

}  // namespace colmap_ext

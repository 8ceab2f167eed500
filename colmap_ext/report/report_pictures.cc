#include "colmap_ext/report/report_pictures.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "colmap_ext/image_file.h"
#include "colmap_ext/thinning.h"

namespace colmap_ext {
namespace {

constexpr int kJpegQuality = 85;

std::string DataUri(const cv::Mat& picture, bool lossless) {
  std::vector<unsigned char> bytes;
  if (lossless) {
    cv::imencode(".png", picture, bytes);
  } else {
    cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  }
  return std::string("data:image/") + (lossless ? "png" : "jpeg") + ";base64," +
         Base64({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

// A picture whose pixel is colour(x, y) of the map's nearest pixel.
template <typename Pixel, typename Map, typename Colour>
cv::Mat Paint(const Map& map, int longest_side, int type, Colour colour) {
  const auto [width, height] = FittingSize(map.width(), map.height(), longest_side);
  cv::Mat picture(height, width, type);
  for (int y = 0; y < height; ++y) {
    const int my = NearestPixel(y, height, map.height());
    for (int x = 0; x < width; ++x) picture.at<Pixel>(y, x) = colour(NearestPixel(x, width, map.width()), my);
  }
  return picture;
}

// 0 means "nothing here" and stays black; 1 to 255 span the range.
cv::Mat Coloured(const cv::Mat& levels, int colour_map, const cv::Scalar& nothing) {
  cv::Mat picture;
  cv::applyColorMap(levels, picture, colour_map);
  picture.setTo(nothing, levels == 0);
  return picture;
}

std::uint8_t Level(double share) { return static_cast<std::uint8_t>(1 + 254 * std::clamp(share, 0.0, 1.0)); }

}  // namespace

std::string DepthPicture(const phi::Array2D<float>& depth, DepthRange range, int longest_side) {
  const double span = std::max(1e-12, static_cast<double>(range.upper) - range.lower);
  const cv::Mat levels = Paint<std::uint8_t>(depth, longest_side, CV_8UC1, [&](int x, int y) -> std::uint8_t {
    const float d = depth(x, y);
    return d > 0 ? Level(1 - (d - range.lower) / span) : 0;  // near is warm
  });
  return DataUri(Coloured(levels, cv::COLORMAP_TURBO, cv::Scalar::all(0)), false);
}

std::string NormalPicture(const phi::Array2D<phi::Vec3f>& normals, int longest_side) {
  // x right as red, y up as green, towards the camera as blue, as normal maps are usually shown.
  const cv::Mat picture = Paint<cv::Vec3b>(normals, longest_side, CV_8UC3, [&](int x, int y) {
    const phi::Vec3f n = normals(x, y);
    if (phi::Dot(n, n) < 0.25f) return cv::Vec3b(0, 0, 0);
    return cv::Vec3b(Level(0.5 - 0.5 * n.z), Level(0.5 - 0.5 * n.y), Level(0.5 + 0.5 * n.x));
  });
  return DataUri(picture, false);
}

std::string CostPicture(const phi::Array2D<float>& cost, int longest_side) {
  const cv::Mat levels =
      Paint<std::uint8_t>(cost, longest_side, CV_8UC1, [&](int x, int y) { return Level(cost(x, y) / 2.0); });
  return DataUri(Coloured(levels, cv::COLORMAP_INFERNO, cv::Scalar::all(0)), false);
}

std::string ConfidencePicture(const phi::Array2D<float>& confidence, int longest_side) {
  const cv::Mat levels = Paint<std::uint8_t>(confidence, longest_side, CV_8UC1, [&](int x, int y) -> std::uint8_t {
    return confidence(x, y) > 0 ? Level(confidence(x, y)) : 0;
  });
  return DataUri(Coloured(levels, cv::COLORMAP_VIRIDIS, cv::Scalar::all(0)), false);
}

std::string MaskPicture(const phi::Mask& mask, int longest_side) {
  const cv::Mat picture =
      Paint<std::uint8_t>(mask, longest_side, CV_8UC1, [&](int x, int y) { return mask(x, y); });
  return DataUri(picture, true);
}

std::string DifferencePicture(const phi::Array2D<float>& depth, const phi::Array2D<float>& other,
                              int longest_side) {
  const cv::Mat levels = Paint<std::uint8_t>(depth, longest_side, CV_8UC1, [&](int x, int y) -> std::uint8_t {
    const float d = depth(x, y);
    const float g = other(NearestPixel(x, depth.width(), other.width()), NearestPixel(y, depth.height(), other.height()));
    return d > 0 && g > 0 ? Level(std::abs(d - g) / g / kMaxRelativeDifference) : 0;
  });
  return DataUri(Coloured(levels, cv::COLORMAP_VIRIDIS, cv::Scalar::all(128)), false);
}

std::string PhotoPicture(const std::string& image_path, int longest_side) {
  const ColorImage photo = DecodeReducedColor(ReadPhotoFile(image_path), longest_side);
  const auto [width, height] = FittingSize(photo.width(), photo.height(), longest_side);
  ColorImage small = Resize(photo, width, height);
  cv::Mat bgr;
  cv::cvtColor(cv::Mat(height, width, CV_8UC3, small.data()), bgr, cv::COLOR_RGB2BGR);
  return DataUri(bgr, false);
}

std::string Base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return k < bytes.size() ? static_cast<unsigned char>(bytes[k]) : 0u;
    };
    const unsigned group = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    text += kDigits[group >> 18];
    text += kDigits[group >> 12 & 63];
    text += i + 1 < bytes.size() ? kDigits[group >> 6 & 63] : '=';
    text += i + 2 < bytes.size() ? kDigits[group & 63] : '=';
  }
  return text;
}

}  // namespace colmap_ext

#include "colmap_ext/image_file.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/tiff_orientation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

Bytes ReadAllBytes(const fs::path& path) {
  std::error_code error;
  const bool is_file = fs::is_regular_file(path, error);
  const std::uintmax_t num_bytes = is_file ? fs::file_size(path, error) : 0;
  std::ifstream file(path, std::ios::binary);
  if (!is_file || error || !file) {
    throw phi::InputError(path.string() + ": this image is missing or cannot be opened; restore it");
  }
  Bytes bytes(num_bytes);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(num_bytes));
  if (!file) throw phi::InputError(path.string() + ": reading the image broke off; check the disk");
  return bytes;
}

// JPEG decoders fill up what is missing with gray and say nothing, so look for the end marker ourselves:
// within compressed data a byte 0xFF is never followed by 0xD9.
bool IsTruncatedJpeg(const Bytes& bytes) {
  if (bytes.size() < 4 || bytes[0] != 0xFF || bytes[1] != 0xD8) return false;
  std::size_t at = 2;
  // Walk the header's segments, since a thumbnail within one has an end marker of its own.
  while (at + 4 <= bytes.size() && bytes[at] == 0xFF) {
    if (bytes[at + 1] == 0xFF) {
      ++at;  // fill byte
      continue;
    }
    const bool starts_scan = bytes[at + 1] == 0xDA;
    at += 2 + (std::size_t{bytes[at + 2]} << 8 | bytes[at + 3]);
    if (starts_scan) break;
  }
  if (at >= bytes.size()) return true;
  const std::uint8_t end_marker[] = {0xFF, 0xD9};
  return std::search(bytes.begin() + at, bytes.end(), std::begin(end_marker), std::end(end_marker)) ==
         bytes.end();
}

cv::Mat Decode(const fs::path& path, int flags) {
  Bytes bytes = ReadAllBytes(path);
  IgnoreTiffOrientation(bytes);
  if (IsTruncatedJpeg(bytes)) {
    throw phi::InputError(path.string() + ": this JPEG is cut short; copy or undistort it again");
  }
  cv::Mat image;
  try {
    if (!bytes.empty()) image = cv::imdecode(bytes, flags | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& exception) {
    throw phi::InputError(path.string() + ": this image cannot be decoded (" + exception.err + ")");
  }
  if (image.empty()) {
    throw phi::InputError(path.string() +
                          ": this image is damaged or of an unknown format; copy or undistort it again");
  }
  return image;
}

template <typename Pixel>
cv::Mat Wrap(const phi::Array2D<Pixel>& image) {
  const int type = sizeof(Pixel) == 1 ? CV_8UC1 : CV_8UC3;
  return cv::Mat(image.height(), image.width(), type, const_cast<Pixel*>(image.data()));
}

template <typename Pixel>
phi::Array2D<Pixel> ResizeAny(const phi::Array2D<Pixel>& image, int width, int height) {
  if (image.width() == width && image.height() == height) return image;
  phi::Array2D<Pixel> resized(width, height);
  cv::Mat target = Wrap(resized);
  const bool shrinks = width <= image.width() && height <= image.height();
  cv::resize(Wrap(image), target, target.size(), 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
  return resized;
}

void Encode(const fs::path& path, const cv::Mat& image, int jpeg_quality) {
  Bytes bytes;
  try {
    if (!cv::imencode(path.extension().string(), image, bytes, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality})) {
      throw phi::InputError(path.string() + ": the image cannot be encoded");
    }
  } catch (const cv::Exception&) {
    throw phi::InputError(path.string() + ": no image format has this extension; use .png or .jpg");
  }
  AtomicFile file(path);
  file.Write(bytes.data(), bytes.size());
  file.Commit();
}

}  // namespace

phi::GrayImage ReadGrayImage(const fs::path& path) {
  const cv::Mat decoded = Decode(path, cv::IMREAD_GRAYSCALE);
  phi::GrayImage image(decoded.cols, decoded.rows);
  decoded.copyTo(Wrap(image));
  return image;
}

ColorImage ReadColorImage(const fs::path& path) {
  const cv::Mat decoded = Decode(path, cv::IMREAD_COLOR);
  ColorImage image(decoded.cols, decoded.rows);
  cv::cvtColor(decoded, Wrap(image), cv::COLOR_BGR2RGB);
  return image;
}

phi::GrayImage Resize(const phi::GrayImage& image, int width, int height) {
  return ResizeAny(image, width, height);
}
ColorImage Resize(const ColorImage& image, int width, int height) { return ResizeAny(image, width, height); }

void WriteGrayImage(const fs::path& path, const phi::GrayImage& image, int jpeg_quality) {
  Encode(path, Wrap(image), jpeg_quality);
}

void WriteColorImage(const fs::path& path, const ColorImage& image, int jpeg_quality) {
  cv::Mat bgr;
  cv::cvtColor(Wrap(image), bgr, cv::COLOR_RGB2BGR);
  Encode(path, bgr, jpeg_quality);
}

}  // namespace colmap_ext

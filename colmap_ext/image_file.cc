#include "colmap_ext/image_file.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/jpeg_decoder.h"
#include "colmap_ext/png_decoder.h"
#include "colmap_ext/tiff_orientation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uintmax_t kMaxImageBytes = std::numeric_limits<std::int32_t>::max();  // as decoders count

Bytes ReadAllBytes(const fs::path& path) {
  std::error_code error;
  const bool is_file = fs::is_regular_file(path, error);
  const std::uintmax_t num_bytes = is_file ? fs::file_size(path, error) : 0;
  std::ifstream file = OpenRegularFile(path);
  if (!is_file || error || !file) {
    throw phi::InputError(phi::AboutFile(path) + ": this image is missing or cannot be opened; restore it");
  }
  if (num_bytes > kMaxImageBytes) {
    throw phi::InputError(phi::AboutFile(path) + ": the file has " + std::to_string(num_bytes) +
                          " bytes, more than any image; copy or undistort it again");
  }
  Bytes bytes(num_bytes);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(num_bytes));
  if (!file) throw phi::InputError(phi::AboutFile(path) + ": reading the image broke off; check the disk");
  return bytes;
}

// Neither JPEG nor PNG.
cv::Mat Decode(const PhotoFile& photo, int flags, const CheckSize& check_size) {
  const auto& [path, bytes] = photo;
  cv::Mat image;
  try {
    if (HasPhotoFormat(bytes)) image = cv::imdecode(bytes, flags | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& exception) {
    throw phi::InputError(phi::AboutFile(path) + ": this image cannot be decoded (" + exception.err + ")");
  }
  if (image.empty()) {
    throw phi::InputError(phi::AboutFile(path) +
                          ": this image is damaged or of an unknown format; copy or undistort it again, as JPEG, PNG or TIFF of 8 or 16 bits");
  }
  if (check_size) check_size(static_cast<std::size_t>(image.cols), static_cast<std::size_t>(image.rows));
  return image;
}

template <typename Pixel>
cv::Mat Wrap(const phi::Array2D<Pixel>& image) {
  const int type = sizeof(Pixel) == 1 ? CV_8UC1 : sizeof(Pixel) == 2 ? CV_16UC1 : CV_8UC3;
  return cv::Mat(image.height(), image.width(), type, const_cast<Pixel*>(image.data()));
}

ColorImage FromBgr(const cv::Mat& decoded) {
  ColorImage image(decoded.cols, decoded.rows);
  cv::cvtColor(decoded, Wrap(image), cv::COLOR_BGR2RGB);
  return image;
}

template <typename Pixel>
phi::Array2D<Pixel> ResizeAny(const phi::Array2D<Pixel>& image, int width, int height) {
  phi::Array2D<Pixel> resized(width, height);
  cv::Mat target = Wrap(resized);
  const bool shrinks = width <= image.width() && height <= image.height();
  cv::resize(Wrap(image), target, target.size(), 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
  return resized;
}

template <typename Pixel>
phi::Array2D<Pixel> ResizeOrKeep(phi::Array2D<Pixel> image, int width, int height) {
  return image.width() == width && image.height() == height ? std::move(image) : ResizeAny(image, width, height);
}

std::unique_ptr<AtomicFile> Encode(const fs::path& path, const cv::Mat& image, int jpeg_quality,
                                   Durability durability = Durability::kPowerCut) {
  Bytes bytes;
  try {
    if (!cv::imencode(path.extension().string(), image, bytes, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality})) {
      throw phi::InputError(phi::AboutFile(path) + ": the image cannot be encoded");
    }
  } catch (const cv::Exception&) {
    throw phi::InputError(phi::AboutFile(path) + ": no image format has this extension; use .png or .jpg");
  }
  auto file = std::make_unique<AtomicFile>(path, durability);
  file->Write(bytes.data(), bytes.size());
  file->Complete();
  return file;
}

}  // namespace

bool HasPhotoFormat(std::span<const std::uint8_t> bytes) {
  using namespace std::string_view_literals;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("RIFF") && text.substr(std::min<std::size_t>(8, text.size())).starts_with("WEBP")) return true;
  const bool is_pnm = text.size() > 2 && text[0] == 'P' && text[1] >= '1' && text[1] <= '7';
  constexpr std::string_view kSignatures[] = {
      "\xFF\xD8\xFF"sv,                                           // JPEG
      "\x89PNG\r\n\x1A\n"sv, "II*\0"sv, "MM\0*"sv, "II+\0"sv,  // PNG, TIFF
      "MM\0+"sv, "BM"sv,                                          // BMP
      "\0\0\0\x0CjP  "sv, "\xFF\x4F\xFF\x51"sv};                // JPEG 2000
  return is_pnm || std::any_of(std::begin(kSignatures), std::end(kSignatures),
                               [&](std::string_view signature) { return text.starts_with(signature); });
}

PhotoFile ReadPhotoFile(const fs::path& path) {
  PhotoFile photo{path, ReadAllBytes(path)};
  IgnoreTiffOrientation(photo.bytes);
  return photo;
}

phi::GrayImage DecodeGray(const PhotoFile& photo, const CheckSize& check_size) {
  if (IsJpeg(photo.bytes)) return DecodeJpegGray(photo, check_size);
  if (IsPng(photo.bytes)) return DecodePngGray(photo, check_size);
  const cv::Mat decoded = Decode(photo, cv::IMREAD_GRAYSCALE, check_size);
  phi::GrayImage image(decoded.cols, decoded.rows);
  decoded.copyTo(Wrap(image));
  return image;
}

ColorImage DecodeColor(const PhotoFile& photo, const CheckSize& check_size) {
  if (IsJpeg(photo.bytes)) return DecodeJpegColor(photo, check_size);
  return IsPng(photo.bytes) ? DecodePngColor(photo, check_size) : FromBgr(Decode(photo, cv::IMREAD_COLOR, check_size));
}

namespace {

// Of 8 bits, or of 16 where the file has so many.
cv::Mat DecodeGrayOfAnyDepth(const PhotoFile& photo, const CheckSize& check_size) {
  const bool is_png = IsPng(photo.bytes);
  if (is_png && PngPixelsOf(photo.bytes).bits == 16) return Wrap(DecodePngGray16(photo, check_size)).clone();
  if (is_png || IsJpeg(photo.bytes)) return Wrap(DecodeGray(photo, check_size)).clone();
  return Decode(photo, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH, check_size);
}

}  // namespace

std::optional<int> Brightest16Bit(const PhotoFile& photo, const CheckSize& check_size) {
  // What the header tells is not decoded for.
  if (IsJpeg(photo.bytes) || (IsPng(photo.bytes) && PngPixelsOf(photo.bytes).bits < 16)) return {};
  const cv::Mat decoded = DecodeGrayOfAnyDepth(photo, check_size);
  if (decoded.depth() != CV_16U) return {};
  double brightest = 0;
  cv::minMaxLoc(decoded, nullptr, &brightest);
  return static_cast<int>(brightest);
}

ColorImage DecodeReducedColor(const PhotoFile& photo, int longest_side) {
  return IsJpeg(photo.bytes) ? DecodeJpegColor(photo, {}, longest_side) : DecodeColor(photo);
}

phi::GrayImage ReadGrayImage(const fs::path& path, const CheckSize& check_size) {
  return DecodeGray(ReadPhotoFile(path), check_size);
}

ColorImage ReadColorImage(const fs::path& path, const CheckSize& check_size) {
  return DecodeColor(ReadPhotoFile(path), check_size);
}

phi::GrayImage ReadImageMaskFile(const fs::path& path, const CheckSize& check_size) {
  const cv::Mat decoded = DecodeGrayOfAnyDepth(ReadPhotoFile(path), check_size);
  phi::GrayImage mask(decoded.cols, decoded.rows);
  cv::Mat target = Wrap(mask);
  cv::compare(decoded, 0, target, cv::CMP_NE);
  return mask;
}

phi::Array2D<std::uint16_t> ReadGray16Image(const fs::path& path) {
  const PhotoFile photo = ReadPhotoFile(path);
  const PngPixels png = IsPng(photo.bytes) ? PngPixelsOf(photo.bytes) : PngPixels();
  if (png.is_gray && png.bits == 16) return DecodePngGray16(photo, {});
  const bool is_other = !IsJpeg(photo.bytes) && !IsPng(photo.bytes);
  const cv::Mat decoded = is_other ? Decode(photo, cv::IMREAD_UNCHANGED, {}) : cv::Mat();
  if (decoded.type() != CV_16UC1) {
    throw phi::InputError(phi::AboutFile(path) + " is not a 16-bit gray image, as true depths in PNG files are");
  }
  phi::Array2D<std::uint16_t> image(decoded.cols, decoded.rows);
  decoded.copyTo(Wrap(image));
  return image;
}

phi::GrayImage Resize(phi::GrayImage image, int width, int height) { return ResizeOrKeep(std::move(image), width, height); }
ColorImage Resize(ColorImage image, int width, int height) { return ResizeOrKeep(std::move(image), width, height); }

std::unique_ptr<AtomicFile> PrepareGrayImage(const fs::path& path, const phi::GrayImage& image,
                                             Durability durability) {
  return Encode(path, Wrap(image), kJpegQuality, durability);
}

void WriteGrayImage(const fs::path& path, const phi::GrayImage& image, int jpeg_quality) {
  Encode(path, Wrap(image), jpeg_quality)->Commit();
}

void WriteColorImage(const fs::path& path, const ColorImage& image, int jpeg_quality) {
  cv::Mat bgr;
  cv::cvtColor(Wrap(image), bgr, cv::COLOR_RGB2BGR);
  Encode(path, bgr, jpeg_quality)->Commit();
}

}  // namespace colmap_ext

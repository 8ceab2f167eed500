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

std::size_t BigEndian(const Bytes& bytes, std::size_t at, int num_bytes) {
  std::size_t value = 0;
  for (int i = 0; i < num_bytes; ++i) value = value << 8 | bytes[at + i];
  return value;
}

bool IsJpeg(const Bytes& bytes) { return bytes.size() >= 4 && bytes[0] == 0xFF && bytes[1] == 0xD8; }

constexpr std::uint8_t kStartOfScan = 0xDA;

constexpr std::size_t kPngHeaderBytes = 25;  // up to the bits of a channel

bool IsPng(const Bytes& bytes) {
  constexpr std::uint8_t kSignature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  return bytes.size() >= kPngHeaderBytes && std::equal(std::begin(kSignature), std::end(kSignature), bytes.begin());
}

struct ImageSize {
  std::size_t width = 0, height = 0;
};

// The place behind the segments of a JPEG's header, or that of the one where stops(marker, place) ends the walk.
template <typename Stops>
std::size_t WalkSegments(const Bytes& bytes, const Stops& stops) {
  std::size_t at = 2;
  while (at + 4 <= bytes.size() && bytes[at] == 0xFF) {
    if (bytes[at + 1] == 0xFF) {
      ++at;  // fill byte
      continue;
    }
    if (stops(bytes[at + 1], at)) break;
    at += 2 + BigEndian(bytes, at + 2, 2);
  }
  return at;
}

// From the header of a PNG or a JPEG; nothing where the decoder has to find out. A small file can announce an image of
// gigabytes.
std::optional<ImageSize> AnnouncedSize(const Bytes& bytes) {
  if (IsPng(bytes)) return ImageSize{BigEndian(bytes, 16, 4), BigEndian(bytes, 20, 4)};
  if (!IsJpeg(bytes)) return {};
  std::optional<ImageSize> size;
  WalkSegments(bytes, [&](std::uint8_t marker, std::size_t at) {
    // Frame headers; of the codes in their range these three are others.
    const bool is_frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (is_frame && at + 9 <= bytes.size()) size = ImageSize{BigEndian(bytes, at + 7, 2), BigEndian(bytes, at + 5, 2)};
    return is_frame;
  });
  return size;
}

// JPEG decoders fill up what is missing with gray and say nothing, so look for the end marker ourselves:
// within compressed data a byte 0xFF is never followed by 0xD9.
bool IsTruncatedJpeg(const Bytes& bytes) {
  if (!IsJpeg(bytes)) return false;
  // Behind the header's segments, since a thumbnail within one has an end marker of its own.
  const std::size_t at = WalkSegments(bytes, [](std::uint8_t marker, std::size_t) { return marker == kStartOfScan; });
  if (at >= bytes.size()) return true;
  const std::uint8_t end_marker[] = {0xFF, 0xD9};
  return std::search(bytes.begin() + at, bytes.end(), std::begin(end_marker), std::end(end_marker)) ==
         bytes.end();
}

cv::Mat Decode(const PhotoFile& photo, int flags, const CheckSize& check_size) {
  const auto& [path, bytes] = photo;
  if (const auto size = AnnouncedSize(bytes); size && check_size) check_size(size->width, size->height);
  if (IsTruncatedJpeg(bytes)) {
    throw phi::InputError(phi::AboutFile(path) + ": this JPEG is cut short; copy or undistort it again");
  }
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
  const cv::Mat decoded = Decode(photo, cv::IMREAD_GRAYSCALE, check_size);
  phi::GrayImage image(decoded.cols, decoded.rows);
  decoded.copyTo(Wrap(image));
  return image;
}

ColorImage DecodeColor(const PhotoFile& photo, const CheckSize& check_size) {
  return FromBgr(Decode(photo, cv::IMREAD_COLOR, check_size));
}

std::optional<int> Brightest16Bit(const PhotoFile& photo, const CheckSize& check_size) {
  // What the header tells is not decoded for.
  if (IsJpeg(photo.bytes) || (IsPng(photo.bytes) && photo.bytes[kPngHeaderBytes - 1] < 16)) return {};
  const cv::Mat decoded = Decode(photo, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH, check_size);
  if (decoded.depth() != CV_16U) return {};
  double brightest = 0;
  cv::minMaxLoc(decoded, nullptr, &brightest);
  return static_cast<int>(brightest);
}

ColorImage DecodeReducedColor(const PhotoFile& photo, int longest_side) {
  const std::optional<ImageSize> size = IsJpeg(photo.bytes) ? AnnouncedSize(photo.bytes) : std::nullopt;
  const std::size_t longest = size ? std::max(size->width, size->height) : 0, wanted = static_cast<std::size_t>(longest_side);
  const int flags = longest >= 8 * wanted   ? cv::IMREAD_REDUCED_COLOR_8
                    : longest >= 4 * wanted ? cv::IMREAD_REDUCED_COLOR_4
                    : longest >= 2 * wanted ? cv::IMREAD_REDUCED_COLOR_2
                                            : cv::IMREAD_COLOR;
  return FromBgr(Decode(photo, flags, {}));
}

phi::GrayImage ReadGrayImage(const fs::path& path, const CheckSize& check_size) {
  return DecodeGray(ReadPhotoFile(path), check_size);
}

ColorImage ReadColorImage(const fs::path& path, const CheckSize& check_size) {
  return DecodeColor(ReadPhotoFile(path), check_size);
}

phi::GrayImage ReadImageMaskFile(const fs::path& path, const CheckSize& check_size) {
  const cv::Mat decoded = Decode(ReadPhotoFile(path), cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH, check_size);
  phi::GrayImage mask(decoded.cols, decoded.rows);
  cv::Mat target = Wrap(mask);
  cv::compare(decoded, 0, target, cv::CMP_NE);
  return mask;
}

phi::Array2D<std::uint16_t> ReadGray16Image(const fs::path& path) {
  const cv::Mat decoded = Decode(ReadPhotoFile(path), cv::IMREAD_UNCHANGED, {});
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

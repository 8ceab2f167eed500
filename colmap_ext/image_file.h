// Images as phimvs sees them: 8-bit gray or RGB of the file's stored pixels (an orientation tag is ignored,
// as COLMAP's cameras describe the stored pixels), whatever the file's depth and channels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "phi/base/images.h"

namespace colmap_ext {

using Rgb = std::array<std::uint8_t, 3>;
using ColorImage = phi::Array2D<Rgb>;

// Whether a file's bytes begin as one of the formats that photos come in: JPEG, PNG, TIFF, BMP, WebP, PNM, JPEG 2000. OpenCV
// tries every library that it was built with, and some of those for other formats (DICOM's) end the process where a file is
// damaged.
bool HasPhotoFormat(std::span<const std::uint8_t> bytes);

// Throws when an image of so many pixels is not wanted. Called before anything is decoded where the header tells the size,
// and afterwards.
using CheckSize = std::function<void(std::size_t width, std::size_t height)>;

// A photo as its file holds it.
struct PhotoFile {
  std::filesystem::path path;
  std::vector<std::uint8_t> bytes;
};

// Throws phi::InputError naming the file when it is missing or cannot be read.
PhotoFile ReadPhotoFile(const std::filesystem::path& path);

// Throw phi::InputError naming the file when it is damaged, cut short or of no known format.
phi::GrayImage DecodeGray(const PhotoFile& photo, const CheckSize& check_size = {});
ColorImage DecodeColor(const PhotoFile& photo, const CheckSize& check_size = {});

// The largest value of a photo with 16 bits a channel; none of others.
std::optional<int> Brightest16Bit(const PhotoFile& photo, const CheckSize& check_size = {});

// For pictures of it: a JPEG is decoded to a half, a quarter or an eighth, as long as that leaves a longer side of at least
// `longest_side` pixels; others are not reduced.
ColorImage DecodeReducedColor(const PhotoFile& photo, int longest_side);

// Read and decode.
phi::GrayImage ReadGrayImage(const std::filesystem::path& path, const CheckSize& check_size = {});
ColorImage ReadColorImage(const std::filesystem::path& path, const CheckSize& check_size = {});

// A mask that users give, in gray: 0 where it is 0, 255 elsewhere. Numbers of things in 16 bits would all be 0 in 8.
phi::GrayImage ReadImageMaskFile(const std::filesystem::path& path, const CheckSize& check_size = {});

// The 16-bit values as they are stored; refuses other pixels.
phi::Array2D<std::uint16_t> ReadGray16Image(const std::filesystem::path& path);

// Area average where it shrinks, bilinear where it grows.
phi::GrayImage Resize(phi::GrayImage image, int width, int height);
ColorImage Resize(ColorImage image, int width, int height);

// The format follows from the name's extension; JPEG at `jpeg_quality` percent.
inline constexpr int kJpegQuality = 95;
void WriteGrayImage(const std::filesystem::path& path, const phi::GrayImage& image,
                    int jpeg_quality = kJpegQuality);
void WriteColorImage(const std::filesystem::path& path, const ColorImage& image,
                     int jpeg_quality = kJpegQuality);
// The complete file, without its name yet.
std::unique_ptr<AtomicFile> PrepareGrayImage(const std::filesystem::path& path, const phi::GrayImage& image,
                                             Durability durability);

}  // namespace colmap_ext

// JPEG photos by libjpeg itself: OpenCV, which decodes the others, fills up with gray what is damaged and leaves a line without a
// name on stderr.
#pragma once

#include <cstdint>
#include <span>

#include "colmap_ext/image_file.h"

namespace colmap_ext {

bool IsJpeg(std::span<const std::uint8_t> bytes);

// The same bytes as OpenCV's: gray is the luma of the file. Throw as DecodeGray and DecodeColor.
phi::GrayImage DecodeJpegGray(const PhotoFile& photo, const CheckSize& check_size);
// longest_side: as DecodeReducedColor's; 0: not reduced.
ColorImage DecodeJpegColor(const PhotoFile& photo, const CheckSize& check_size, int longest_side = 0);

}  // namespace colmap_ext

// The orientation tag of TIFF files.
#pragma once

#include <cstdint>
#include <span>

namespace colmap_ext {

// Sets the tag of a TIFF file's first image to "as stored"; other bytes and other files stay as they are. OpenCV turns
// TIFF images by their tag whatever it is told, and COLMAP, whose cameras fit the stored rows, never does.
void IgnoreTiffOrientation(std::span<std::uint8_t> file);

}  // namespace colmap_ext

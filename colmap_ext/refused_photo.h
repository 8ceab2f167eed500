// What the decoders of photos refuse, each of its format ("JPEG"), in the same words.
#pragma once

#include <cstddef>
#include <string>

#include "colmap_ext/image_file.h"
#include "phi/base/error.h"

namespace colmap_ext {

// `problem`: "is cut short".
[[noreturn]] inline void RefusePhoto(const PhotoFile& photo, const std::string& format, const std::string& problem) {
  throw phi::InputError(phi::AboutFile(photo.path) + ": this " + format + " " + problem + "; copy or undistort it again");
}

// A small file can announce an image of gigabytes.
inline void RefuseTooManyPixels(const PhotoFile& photo, const std::string& format, std::size_t width, std::size_t height) {
  constexpr std::size_t kMaxPixels = std::size_t{1} << 30;  // as OpenCV
  if (width * height > kMaxPixels) RefusePhoto(photo, format, "has more pixels than any photo");
}

}  // namespace colmap_ext

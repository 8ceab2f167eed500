// A photo moved to where its camera sees its points (phi/image_corrections.h).
#pragma once

#include "phi/base/images.h"
#include "phi/geometry/image_correction.h"

namespace colmap_ext {

// image: the photo at its working resolution. Between its pixels by Lanczos' kernel; what lies beyond the border repeats it.
phi::GrayImage MoveImage(const phi::GrayImage& image, const phi::ImageCorrection& correction);

}  // namespace colmap_ext

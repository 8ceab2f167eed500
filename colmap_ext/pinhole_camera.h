// Which of a model's cameras dense stereo takes, and their intrinsics.
#pragma once

#include <string>

#include "colmap_ext/sparse_model.h"
#include "phi/geometry/camera.h"

namespace colmap_ext {

// Empty, or why the camera cannot be used: it is no pinhole, its distortion is not 0, or no lens has such numbers.
std::string PinholeProblem(const SparseCamera& camera);

// The intrinsics at its full size of a camera without a problem.
phi::Pinhole MakePinhole(const SparseCamera& camera);

// The camera of an image that was resized as COLMAP does for max_image_size; <= 0: unchanged.
phi::Pinhole DownsizedPinhole(const phi::Pinhole& full, int max_image_size);

}  // namespace colmap_ext

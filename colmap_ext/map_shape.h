// Maps and masks of another size than their images.
#pragma once

#include "phi/base/message.h"
#include "phi/geometry/camera.h"

namespace colmap_ext {

// Whether a map or mask of `width` x `height` may be of an image of another size, but for rounding to whole pixels.
bool HasShapeOf(int image_width, int image_height, int width, int height);

// The camera of a map of another size than its image. Throws phi::InputError, which begins with `whose`, where the map has
// not the image's shape.
phi::Pinhole CameraOfMap(const phi::Pinhole& image, int width, int height, const phi::Message& whose);

}  // namespace colmap_ext

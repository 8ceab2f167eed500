#include "colmap_ext/map_shape.h"

#include <algorithm>
#include <cmath>

#include "colmap_ext/format_text.h"
#include "phi/base/error.h"

namespace colmap_ext {

bool HasShapeOf(int image_width, int image_height, int width, int height) {
  // Rounding the smaller size moves a side by half a pixel at most, of the image or of the map.
  const double scale_x = static_cast<double>(width) / image_width, scale_y = static_cast<double>(height) / image_height;
  return std::abs(scale_x - scale_y) <= (0.5 / image_width + 0.5 / image_height) * 2 * std::max({scale_x, scale_y, 1.0});
}

phi::Pinhole CameraOfMap(const phi::Pinhole& image, int width, int height, const phi::Message& whose) {
  if (!HasShapeOf(image.width, image.height, width, height)) {
    throw phi::InputError(whose + ": this map is " + SizeText(width, height) + ", which is not the shape of its " +
                          SizeText(image.width, image.height) +
                          " image; it belongs to another image or was made before the undistortion");
  }
  const double scale_x = static_cast<double>(width) / image.width;
  const double scale_y = static_cast<double>(height) / image.height;
  return {width, height, image.fx * scale_x, image.fy * scale_y, image.cx * scale_x, image.cy * scale_y};
}

}  // namespace colmap_ext

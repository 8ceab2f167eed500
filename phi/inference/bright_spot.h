// Spots of photos by their brightness, and where in the photo they lie: lenses darken the corners, and cameras what they like.
#pragma once

#include "phi/geometry/camera.h"

namespace phi {

// A spot in an image.
struct BrightSpot {
  float brightness = 0;      // grey levels
  float squared_radius = 0;  // distance from the principal point, over that of a corner from the image's middle
  float u = 0.5f, v = 0.5f;  // shares of the image's width and height
};

// What two images show of the same.
struct SpotPair {
  BrightSpot reference, source;
};

class PhotoFrame {
 public:
  explicit PhotoFrame(const Pinhole& pinhole)
      : cx_(static_cast<float>(pinhole.cx)),
        cy_(static_cast<float>(pinhole.cy)),
        width_(static_cast<float>(pinhole.width)),
        height_(static_cast<float>(pinhole.height)),
        scale_(4 / (width_ * width_ + height_ * height_)) {}

  // Pixel (x, y), as bright as that.
  BrightSpot Spot(int x, int y, float brightness) const {
    const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
    const float du = u - cx_, dv = v - cy_;
    return {brightness, (du * du + dv * dv) * scale_, u / width_, v / height_};
  }

 private:
  float cx_, cy_, width_, height_, scale_;
};

}  // namespace phi

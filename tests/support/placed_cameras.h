// Sparse models of cameras of 64 x 48 pixels at chosen places, without points.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "colmap_ext/sparse_model.h"

namespace test_support {

struct PlacedCamera {
  double x = 0;     // of the centre
  double turn = 0;  // degrees about y, from looking along z
  double y = 0;     // of the centre
};

// Image k is "k.png" with the id k + 1.
inline colmap_ext::SparseModel ModelOf(const std::vector<PlacedCamera>& cameras) {
  colmap_ext::SparseModel model;
  model.cameras[1] = {1, 1, 64, 48, {60, 60, 32, 24}};
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    colmap_ext::SparseImage image;
    image.image_id = static_cast<std::uint32_t>(k + 1);
    image.camera_id = 1;
    image.name = std::to_string(k) + ".png";
    image.rotation = Eigen::AngleAxisd(-cameras[k].turn * M_PI / 180, Eigen::Vector3d::UnitY());
    image.translation = image.rotation * Eigen::Vector3d(-cameras[k].x, -cameras[k].y, 0);
    model.images.push_back(image);
  }
  return model;
}

}  // namespace test_support

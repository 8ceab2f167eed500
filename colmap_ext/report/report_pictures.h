// Maps as pictures for people, encoded for an HTML page.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "phi/base/images.h"
#include "phi/geometry/plane_hypothesis.h"

namespace colmap_ext {

struct DepthRange {
  float lower = 0, upper = 0;  // world units
};

// All return a data URI. `longest_side`: pixels; maps are thinned to it without blending across edges.
std::string DepthPicture(const phi::Array2D<float>& depth, DepthRange range, int longest_side);
std::string NormalPicture(const phi::Array2D<phi::Vec3f>& normals, int longest_side);
std::string CostPicture(const phi::Array2D<float>& cost, int longest_side);
// Probabilities, 0: black.
std::string ConfidencePicture(const phi::Array2D<float>& confidence, int longest_side);
std::string MaskPicture(const phi::Mask& mask, int longest_side);
// |depth - other| / other, from 0 to kMaxRelativeDifference; grey where one of them has no depth.
std::string DifferencePicture(const phi::Array2D<float>& depth, const phi::Array2D<float>& other,
                              int longest_side);
std::string PhotoPicture(const std::string& image_path, int longest_side);

inline constexpr double kMaxRelativeDifference = 0.05;

std::string Base64(std::string_view bytes);

}  // namespace colmap_ext

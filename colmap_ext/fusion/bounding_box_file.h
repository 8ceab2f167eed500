// COLMAP's --bbox_path: six numbers, the smallest and the largest corner in world units.
#pragma once

#include <filesystem>

#include "phi/fusion/image_fusion.h"

namespace colmap_ext {

// Throws phi::InputError naming the file.
phi::BoundingBox ReadBoundingBox(const std::filesystem::path& path);

}  // namespace colmap_ext

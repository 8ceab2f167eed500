// Masks beside maps (stereo/filled_masks): 8-bit gray PNG. colmap_ext/measurement_file.h says what their values mean.
#pragma once

#include <filesystem>
#include <memory>

#include "colmap_ext/atomic_file.h"
#include "phi/base/images.h"

namespace colmap_ext {

// Throws phi::InputError naming the file when it is missing, damaged, or holds other values than 0, 128 and 255.
phi::Mask ReadMask(const std::filesystem::path& path);
void WriteMask(const std::filesystem::path& path, const phi::Mask& mask);
// The complete file, without its name yet.
std::unique_ptr<AtomicFile> PrepareMask(const std::filesystem::path& path, const phi::Mask& mask,
                                        Durability durability = Durability::kPowerCut);

}  // namespace colmap_ext

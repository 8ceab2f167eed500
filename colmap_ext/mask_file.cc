#include "colmap_ext/mask_file.h"

#include <algorithm>

#include "colmap_ext/image_file.h"
#include "phi/base/error.h"

namespace colmap_ext {

phi::Mask ReadMask(const std::filesystem::path& path) {
  phi::Mask mask = ReadGrayImage(path);
  if (std::any_of(mask.begin(), mask.end(), [](std::uint8_t v) { return v != 0 && v != 128 && v != 255; })) {
    throw phi::InputError(phi::AboutFile(path) +
                          ": a mask holds 0, 128 and 255 only; delete it and compute it again");
  }
  return mask;
}

std::unique_ptr<AtomicFile> PrepareMask(const std::filesystem::path& path, const phi::Mask& mask,
                                        Durability durability) {
  return PrepareGrayImage(path, mask, durability);
}

void WriteMask(const std::filesystem::path& path, const phi::Mask& mask) { WriteGrayImage(path, mask); }

}  // namespace colmap_ext

// Reads what fusion needs of an image into one map: depth, normals, colours, which pixels were inferred, the mask.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "colmap_ext/workspace.h"
#include "phi/fusion/fusion_pixel.h"

namespace colmap_ext {

struct FusionInput {
  std::string kind{kGeometric};     // the maps'
  std::filesystem::path mask_path;  // folder of <image name>.png, 0 = leave out; may be empty
  bool downsize = false;            // read maps at most at the workspace's working resolution
};

class FusionMapReader {
 public:
  // The workspace must outlive the reader. Throws phi::InputError when there is no folder of masks.
  FusionMapReader(const Workspace& workspace, FusionInput input);

  // Whether the image has both maps.
  bool Exists(int image) const;
  bool HasMask(int image) const { return std::filesystem::exists(MaskPath(image)); }
  // The camera at the size of the map, from the map's header alone. Throws phi::InputError when a map is damaged, the two
  // maps differ in size, or their shape is not the image's.
  phi::Camera ReadCamera(int image) const;
  phi::FusionMap Read(int image) const;

  // What a map of so many pixels takes while it is read and afterwards.
  static std::int64_t TransientBytes(std::int64_t num_pixels);
  static std::int64_t ResidentBytes(std::int64_t num_pixels);

 private:
  std::filesystem::path MaskPath(int image) const;
  void AddMaps(int image, phi::FusionMap* map) const;
  void AddColors(int image, phi::FusionMap* map) const;
  void AddInferred(int image, phi::FusionMap* map) const;
  void ApplyMask(int image, phi::FusionMap* map) const;

  const Workspace& workspace_;
  FusionInput input_;
};

}  // namespace colmap_ext

// Reads what fusion needs of an image into one map: depth, normals, colours, which pixels were inferred, the mask.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/fusion/handed_maps.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/workspace.h"
#include "phi/fusion/fusion_pixel.h"
#include "phi/geometry/device_camera.h"

namespace colmap_ext {

struct FusionInput {
  std::string kind{kGeometric};     // the maps'
  std::filesystem::path mask_path;  // folder of <image name>.png, 0 = leave out; may be empty
  bool downsize = false;            // read maps at most at the workspace's working resolution
};

// Where fusion takes the maps of a workspace's images from. Safe to call concurrently.
class FusionMapSource {
 public:
  virtual ~FusionMapSource() = default;
  // Whether the image has both maps.
  virtual bool Exists(int image) const = 0;
  virtual bool HasMask(int image) const = 0;
  // The camera at the size of the map. Throws phi::InputError when a map is damaged, the two maps differ in size, or their
  // shape is not the image's.
  virtual phi::Camera ReadCamera(int image) const = 0;
  virtual phi::FusionMap Read(int image) const = 0;
};

// A normal that is missing or damaged becomes the direction to the camera.
phi::PackedNormal PackChecked(phi::Vec3f normal, const phi::RayModel& rays, int x, int y);

// What is wrong with a --StereoFusion.mask_path that is no folder.
phi::Message NoFolderOfFusionMasks(const std::filesystem::path& folder);

// From the workspace's files, or from memory.
class FusionMapReader final : public FusionMapSource {
 public:
  // The workspace must outlive the reader, and `handed`: null, or maps of this kind in memory, of its images; an image that is
  // read is given up. Throws phi::InputError when there is no folder of masks.
  FusionMapReader(const Workspace& workspace, FusionInput input, HandedMaps* handed = nullptr);

  bool Exists(int image) const override;
  bool HasMask(int image) const override { return std::filesystem::exists(MaskPath(image)); }
  phi::Camera ReadCamera(int image) const override;  // from the map's size alone
  phi::FusionMap Read(int image) const override;

  // What a map of so many pixels takes while it is read and afterwards.
  static std::int64_t TransientBytes(std::int64_t num_pixels);
  static std::int64_t ResidentBytes(std::int64_t num_pixels);

 private:
  std::filesystem::path MaskPath(int image) const;
  HandedImage Handed(int image) const { return handed_ != nullptr ? (*handed_)[image] : HandedImage(); }
  std::filesystem::path CompactPath(int image) const { return CompactMapPath(workspace_, image, input_.kind); }
  MapSize ReadSize(int image) const;
  phi::Camera CameraOf(int image, const MapSize& size) const;
  // `size`: of the maps; rays: of the fused map's camera.
  void AddMaps(int image, const HandedImage& handed, const MapSize& size, const phi::RayModel& rays, phi::FusionMap* map) const;
  static void AddColors(const ColorImage& colors, phi::FusionMap* map);
  // The mask that says what a map's pixels are; empty where there is none, or the kind needs none.
  phi::Mask ReadStates(int image, const HandedImage& handed) const;
  // Marks inferred pixels of geometric maps, takes clues out of measured ones.
  void AddStates(const phi::Mask& states, phi::FusionMap* map) const;
  void ApplyMask(int image, phi::FusionMap* map) const;

  const Workspace& workspace_;
  FusionInput input_;
  HandedMaps* handed_;
};

}  // namespace colmap_ext

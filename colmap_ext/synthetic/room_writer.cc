// The files of a synthetic room.
#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/fusion_config.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/patch_match_config.h"
#include "colmap_ext/synthetic/room.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxAutomaticSources = 20;  // what undistorters write

void RefuseExisting(const fs::path& folder) {
  if (!fs::exists(folder)) return;
  throw phi::InputError(phi::AboutFile(folder) + " exists; choose another --output_path or remove that folder");
}

void WriteWorkspace(const SyntheticRoom& room, const fs::path& dense) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < room.scene.views.size(); ++i) {
    names.push_back(room.scene.views[i].name);
    const std::vector<std::uint8_t>& bytes = room.image_files[i];
    AtomicFile file(dense / "images" / names.back());
    file.Write(bytes.data(), bytes.size());
    file.Commit();
  }
  fs::create_directories(dense / "sparse");
  WriteSparseModelBinary(room.model, dense / "sparse");
  for (const char* kind : {"depth_maps", "normal_maps", "consistency_graphs"}) {
    fs::create_directories(dense / "stereo" / kind);
  }
  WritePatchMatchConfig(dense / "stereo" / "patch-match.cfg", names, kMaxAutomaticSources);
  WriteFusionConfig(dense / "stereo" / "fusion.cfg", names);
}

void WriteTruth(const RenderedScene& scene, const fs::path& truth) {
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const std::string& name = scene.views[i].name;
    WritePlaneMap(truth / "depth_maps" / (name + ".bin"), truth / "normal_maps" / (name + ".bin"),
                  *scene.truth[i]);
    WriteMask(truth / "textured_masks" / (name + ".png"), *scene.textured[i]);
  }
}

}  // namespace

void WriteSyntheticRoom(const SyntheticRoom& room, const fs::path& folder) {
  RefuseExisting(folder / "dense");
  RefuseExisting(folder / "truth");
  WriteWorkspace(room, folder / "dense");
  WriteTruth(room.scene, folder / "truth");
}

}  // namespace colmap_ext

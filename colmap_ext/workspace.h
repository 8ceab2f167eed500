// An undistorted COLMAP workspace: images/, sparse/, stereo/.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "colmap_ext/sparse_model.h"
#include "phi/backend.h"

namespace colmap_ext {

// The kinds of map a workspace holds (the file names' middle part).
inline constexpr std::string_view kPhotometric = "photometric";
inline constexpr std::string_view kMeasured = "measured";
inline constexpr std::string_view kGeometric = "geometric";

struct WorkspaceOptions {
  std::filesystem::path path;      // --workspace_path
  std::string format = "COLMAP";   // --workspace_format; PMVS is refused in one sentence
  int max_image_size = -1;         // --PatchMatchStereo.max_image_size: longest side of the working resolution, pixels; <= 0 = full
};

// Reads the sparse model at construction; images and maps on request. Safe for concurrent const calls.
class Workspace {
 public:
  explicit Workspace(const WorkspaceOptions& options);

  const std::filesystem::path& path() const { return path_; }
  const SparseModel& model() const { return model_; }
  // Parallel to model().images: names, ids and cameras at the working resolution.
  const std::vector<phi::SceneView>& views() const { return views_; }
  int FindImage(std::string_view name) const;  // index, or -1

  std::filesystem::path ImagePath(int image) const;
  std::filesystem::path DepthMapPath(int image, std::string_view kind) const;
  std::filesystem::path NormalMapPath(int image, std::string_view kind) const;
  std::filesystem::path CostMapPath(int image, std::string_view kind) const;
  std::filesystem::path FilledMaskPath(int image) const;

  // 8-bit gray at the working resolution. Throws phi::InputError naming the file when it is missing, damaged, or its
  // size disagrees with its camera.
  std::shared_ptr<const phi::GrayImage> ReadGray(int image) const;

 private:
  std::filesystem::path path_;
  SparseModel model_;
  std::vector<phi::SceneView> views_;
};

}  // namespace colmap_ext

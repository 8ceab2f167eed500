#include "colmap_ext/evaluation/truth_maps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "colmap_ext/folder_files.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_shape.h"
#include "colmap_ext/measurement_file.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

std::string WithoutSuffix(const std::string& text, const std::string& suffix) {
  return text.ends_with(suffix) ? text.substr(0, text.size() - suffix.size()) : text;
}

}  // namespace

std::map<std::string, std::filesystem::path> FindTruthMaps(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) throw phi::InputError("there is no folder " + phi::AboutFile(folder));
  std::map<std::string, std::filesystem::path> maps;
  for (const std::filesystem::path& file : FilesBelow(folder, HiddenFiles::kIncluded)) {
    const std::string extension = file.extension().string();
    if (extension != ".png" && extension != ".bin") continue;
    std::string name = std::filesystem::path(file).replace_extension().generic_string();
    for (std::string_view kind : {kGeometric, kMeasured, kPhotometric}) {
      if (extension == ".bin") name = WithoutSuffix(name, "." + std::string(kind));
    }
    maps[name] = folder / file;
  }
  if (maps.empty())
    throw phi::InputError(phi::AboutFile(folder) + " holds no map (<image name>.png or <image name>.bin)");
  return maps;
}

std::map<std::string, std::filesystem::path> FindTruthMapsOf(const Workspace& workspace, const std::filesystem::path& folder) {
  auto maps = FindTruthMaps(folder);
  const auto& views = workspace.views();
  const auto has_truth = [&](const phi::SceneView& view) { return maps.contains(view.name); };
  if (std::any_of(views.begin(), views.end(), has_truth)) return maps;
  throw phi::InputError(phi::AboutFile(folder) + ": no true depth map here has the name of an image of " + workspace.path().string() +
                        "; they should be <image name>.png or <image name>.bin, such as " + views.front().name + ".png");
}

phi::Array2D<float> ReadTruthDepth(const std::filesystem::path& path, double values_per_unit) {
  if (path.extension() == ".bin") {
    phi::Array2D<float> depth = ReadPublishedDepths(path);
    std::replace_if(depth.begin(), depth.end(), [](float d) { return !std::isfinite(d); }, 0.0f);
    return depth;
  }
  const phi::Array2D<std::uint16_t> values = ReadGray16Image(path);
  phi::Array2D<float> depth(values.width(), values.height());
  for (std::size_t i = 0; i < values.size(); ++i) depth.data()[i] = static_cast<float>(values.data()[i] / values_per_unit);
  return depth;
}

void RequireShapeOfImage(const phi::Array2D<float>& truth, const std::filesystem::path& path, const phi::SceneView& view) {
  CameraOfMap(view.camera.pinhole, truth.width(), truth.height(),
              phi::AboutFile(path) + ", the truth of " + phi::AboutImage(view.name));
}

}  // namespace colmap_ext

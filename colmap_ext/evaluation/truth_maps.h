// Folders of true depth and normal maps: COLMAP's .bin, or 16-bit PNG depths in fixed units.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "colmap_ext/workspace.h"
#include "phi/base/array2d.h"
#include "phi/base/vec.h"
#include "phi/scene_view.h"

namespace colmap_ext {

// A map file `<image name>.png`, `<image name>.bin` or `<image name>.<kind>.bin`, in subfolders as the names
// have them. Keyed by image name. Throws phi::InputError when the folder holds none.
std::map<std::string, std::filesystem::path> FindTruthMaps(const std::filesystem::path& folder);

// The same; throws, too, when none of them has the name of an image of the workspace.
std::map<std::string, std::filesystem::path> FindTruthMapsOf(const Workspace& workspace, const std::filesystem::path& folder);

// World units; 0 where there is no truth. `values_per_unit`: a PNG's value of one world unit.
phi::Array2D<float> ReadTruthDepth(const std::filesystem::path& path, double values_per_unit);

// Throws phi::InputError where the truth, read from `path`, has not the shape of its image, whatever its size.
void RequireShapeOfImage(const phi::Array2D<float>& truth, const std::filesystem::path& path, const phi::SceneView& view);

}  // namespace colmap_ext

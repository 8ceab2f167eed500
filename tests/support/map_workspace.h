// A workspace on disk with the exact geometric maps of a rendered scene, ready to be fused.
#pragma once

#include <filesystem>
#include <string>

#include "colmap_ext/synthetic/rendered_scene.h"

namespace test_support {

// Image k is named "view k.png" and shows brightness 40 + 20 k everywhere, so that a point's colour tells where it
// comes from. The sparse points are a grid of view 0's pixels.
void WriteMapWorkspace(const colmap_ext::RenderedScene& scene, const std::filesystem::path& folder);

std::string MapWorkspaceImageName(int view);

}  // namespace test_support

// A sparse scene of the views' cameras, without points.
#pragma once

#include <vector>

#include "phi/scene_view.h"
#include "phi/sparse_scene.h"

namespace test_support {

inline phi::SparseScene EmptyScene(const std::vector<phi::SceneView>& views) {
  std::vector<phi::Pinhole> pinholes;
  for (const phi::SceneView& view : views) pinholes.push_back(view.camera.pinhole);
  return phi::SparseScene(pinholes);
}

}  // namespace test_support

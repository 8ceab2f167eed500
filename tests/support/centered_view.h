// A view whose principal point is the middle of its image, at the world's origin.
#pragma once

#include <cstdint>
#include <string>

#include "phi/scene_view.h"

namespace test_support {

inline phi::SceneView CenteredView(std::uint32_t id, int width, int height, double focal) {
  phi::SceneView view;
  view.name = "view" + std::to_string(id);
  view.image_id = id;
  view.camera.pinhole = {width, height, focal, focal, width / 2.0, height / 2.0};
  return view;
}

}  // namespace test_support

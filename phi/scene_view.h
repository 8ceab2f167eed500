// An image of the scene: its name, its camera, and with it its pixels or its map.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "phi/base/images.h"
#include "phi/geometry/camera.h"
#include "phi/measurement.h"

namespace phi {

// One image of the scene at its working resolution (after --PatchMatchStereo.max_image_size).
struct SceneView {
  std::string name;            // COLMAP's image name, may hold subfolders
  std::uint32_t image_id = 0;  // COLMAP's image id: keys the random numbers
  Camera camera;
};

struct ViewImage {
  const SceneView* view = nullptr;
  std::shared_ptr<const GrayImage> image;
};

struct ViewMap {
  const SceneView* view = nullptr;
  std::shared_ptr<const MeasurementMap> map;
};

// The map of a source view, read when its turn comes: a scene's maps need not be in memory at once. `load` may be called
// again, from one thread at a time, and throws phi::Error.
struct SourceMap {
  const SceneView* view = nullptr;
  std::function<std::shared_ptr<const MeasurementMap>()> load = nullptr;  // empty: the view has no map and takes no part
  // What the view leaves out, where it can testify nothing; empty: nothing is left out.
  std::function<std::shared_ptr<const ImageMask>()> load_mask = nullptr;
};

// A sparse point as seen in the reference image. u, v: pixels in K's coordinates; depth: camera z, world units.
struct SparseObservation {
  float u = 0, v = 0, depth = 0;
};

}  // namespace phi

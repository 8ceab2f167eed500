// The sparse model of a rendered scene's views.
#pragma once

#include <string>
#include <vector>

#include "colmap_ext/sparse_model.h"
#include "colmap_ext/synthetic/rendered_scene.h"

namespace test_support {

// Cameras and poses without points. Image k has the name names[k], and k + 1 for its id and its camera's.
colmap_ext::SparseModel ModelOfViews(const colmap_ext::RenderedScene& scene,
                                     const std::vector<std::string>& names);

}  // namespace test_support

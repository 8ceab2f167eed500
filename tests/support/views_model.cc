#include "tests/support/views_model.h"

#include <cstdint>

namespace test_support {

colmap_ext::SparseModel ModelOfViews(const colmap_ext::RenderedScene& scene,
                                     const std::vector<std::string>& names) {
  colmap_ext::SparseModel model;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const phi::Pinhole& k = scene.views[i].camera.pinhole;
    const phi::Pose& pose = scene.views[i].camera.pose;
    const auto id = static_cast<std::uint32_t>(i + 1);
    model.cameras[id] = {id,
                         1,
                         static_cast<std::uint64_t>(k.width),
                         static_cast<std::uint64_t>(k.height),
                         {k.fx, k.fy, k.cx, k.cy}};
    colmap_ext::SparseImage image;
    image.image_id = id;
    image.camera_id = id;
    image.rotation = Eigen::Quaterniond(pose.rotation);
    image.translation = pose.translation;
    image.name = names[i];
    model.images.push_back(image);
  }
  return model;
}

}  // namespace test_support

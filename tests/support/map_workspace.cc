#include "tests/support/map_workspace.h"

#include <vector>

#include "colmap_ext/fusion_config.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/sparse_model.h"
#include "colmap_ext/workspace.h"
#include "tests/support/views_model.h"

namespace test_support {
namespace {

using colmap_ext::SparseModel;

constexpr int kGridStep = 8;  // pixels of view 0 between sparse points

void AddPoints(const colmap_ext::RenderedScene& scene, SparseModel* model) {
  const phi::Camera& first = scene.views[0].camera;
  const phi::PlaneMap& map = *scene.truth[0];
  for (int y = 0; y < map.height(); y += kGridStep) {
    for (int x = 0; x < map.width(); x += kGridStep) {
      const phi::Pinhole& k = first.pinhole;
      const Eigen::Vector3d ray((x + 0.5 - k.cx) / k.fx, (y + 0.5 - k.cy) / k.fy, 1);
      colmap_ext::SparsePoint point;
      point.point3D_id = model->points.size() + 1;
      point.error = 0.5;
      point.xyz = first.pose.rotation.transpose() * (map(x, y).depth * ray - first.pose.translation);
      for (std::size_t i = 0; i < scene.views.size(); ++i) {
        const phi::Pinhole& other = scene.views[i].camera.pinhole;
        const Eigen::Vector3d seen = scene.views[i].camera.pose * point.xyz;
        const double u = other.fx * seen.x() / seen.z() + other.cx,
                     v = other.fy * seen.y() / seen.z() + other.cy;
        if (!(seen.z() > 0 && u >= 0 && v >= 0 && u < other.width && v < other.height)) continue;
        auto& image = model->images[i];
        point.track.push_back({image.image_id, static_cast<std::uint32_t>(image.observations.size())});
        image.observations.push_back({u, v, point.point3D_id});
      }
      model->points.push_back(point);
    }
  }
}

}  // namespace

std::string MapWorkspaceImageName(int view) { return "view " + std::to_string(view) + ".png"; }

void WriteMapWorkspace(const colmap_ext::RenderedScene& scene, const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    names.push_back(MapWorkspaceImageName(static_cast<int>(i)));
  SparseModel model = ModelOfViews(scene, names);
  AddPoints(scene, &model);
  colmap_ext::WriteSparseModelBinary(model, folder / "sparse");
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const phi::Pinhole& k = scene.views[i].camera.pinhole;
    colmap_ext::WriteGrayImage(folder / "images" / names[i],
                               phi::GrayImage(k.width, k.height, static_cast<std::uint8_t>(40 + 20 * i)));
  }
  colmap_ext::WriteFusionConfig(folder / "stereo" / "fusion.cfg", names);
  const colmap_ext::Workspace workspace({.path = folder});
  for (int i = 0; i < static_cast<int>(scene.views.size()); ++i) {
    colmap_ext::WritePlaneMap(workspace.DepthMapPath(i, colmap_ext::kGeometric),
                              workspace.NormalMapPath(i, colmap_ext::kGeometric),
                              *scene.truth[static_cast<std::size_t>(i)]);
  }
}

}  // namespace test_support

#include "python/bindings/scene_arrays.h"

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/workspace_folder.h"
#include "python/bindings/module.h"
#include "python/bindings/text_caster.h"

namespace nb = nanobind;

namespace phimvs_python {
namespace {

// As libpng makes gray of an 8-bit RGB image (it does not round), so that arrays and PNG files give the same maps.
std::uint8_t Gray(const std::uint8_t* rgb) {
  constexpr unsigned kRed = 9797, kGreen = 19234, kOne = 32768;
  if (rgb[0] == rgb[1] && rgb[0] == rgb[2]) return rgb[0];
  return static_cast<std::uint8_t>((kRed * rgb[0] + kGreen * rgb[1] + (kOne - kRed - kGreen) * rgb[2]) / kOne);
}

void SetPhoto(const std::optional<Bytes>& photo, std::pair<int, int> size, colmap_ext::MemoryImage* image) {
  const auto [width, height] = size;
  auto gray = std::make_shared<phi::GrayImage>(width, height);
  if (photo && photo->ndim() == 3) {
    auto color = std::make_shared<colmap_ext::ColorImage>(width, height);
    std::memcpy(color->data(), photo->data(), color->bytes());
    std::transform(color->begin(), color->end(), gray->begin(), [](const colmap_ext::Rgb& c) { return Gray(c.data()); });
    image->color = std::move(color);
  } else if (photo) {
    std::memcpy(gray->data(), photo->data(), gray->bytes());
  }
  image->gray = std::move(gray);
}

phi::Pose PoseOf(const double* m) {
  phi::Pose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) pose.rotation(row, column) = m[4 * row + column];
    pose.translation[row] = m[4 * row + 3];
  }
  return pose;
}

colmap_ext::SparseModel ModelOf(const Scene& scene) {
  colmap_ext::SparseModel model;
  for (std::size_t i = 0; i < scene.names.size(); ++i) {
    const double* k = scene.cameras.data() + 4 * i;
    colmap_ext::SparseCamera camera;
    camera.camera_id = static_cast<std::uint32_t>(i + 1);
    camera.width = static_cast<std::uint64_t>(scene.sizes[i].first);
    camera.height = static_cast<std::uint64_t>(scene.sizes[i].second);
    camera.params = {k, k + 4};
    colmap_ext::SparseImage image;
    image.image_id = scene.ids[i];
    const phi::Pose pose = PoseOf(scene.poses.data() + 16 * i);
    image.rotation = Eigen::Quaterniond(pose.rotation);
    image.translation = pose.translation;
    image.camera_id = camera.camera_id;
    image.name = scene.names[i];
    model.cameras.emplace(camera.camera_id, std::move(camera));
    model.images.push_back(std::move(image));
  }
  model.points.resize(scene.points.shape(0));
  for (std::size_t p = 0; p < model.points.size(); ++p) {
    const double* xyz = scene.points.data() + 3 * p;
    model.points[p].point3D_id = p;
    model.points[p].xyz = {xyz[0], xyz[1], xyz[2]};
  }
  for (std::size_t o = 0; o < scene.observations.shape(0); ++o) {
    const double* row = scene.observations.data() + 4 * o;
    colmap_ext::SparsePoint& point = model.points[static_cast<std::size_t>(row[0])];
    colmap_ext::SparseImage& image = model.images[static_cast<std::size_t>(row[1])];
    point.track.push_back({image.image_id, static_cast<std::uint32_t>(image.observations.size())});
    image.observations.push_back({row[2], row[3], point.point3D_id});
  }
  return model;
}

// Names, ids, sizes, cameras, poses, points, observations and the photos' paths of a workspace, at full size.
nb::tuple ReadScene(const std::string& path) {
  const colmap_ext::Workspace workspace({.path = colmap_ext::FindWorkspaceFolder(path)});
  const phi::SparseScene scene = colmap_ext::MakeSparseScene(workspace.model());
  std::vector<std::string> names, paths;
  std::vector<std::uint32_t> ids;
  std::vector<double> cameras, poses, points, observations;
  for (std::size_t i = 0; i < workspace.views().size(); ++i) {
    const phi::SceneView& view = workspace.views()[i];
    names.push_back(view.name);
    ids.push_back(view.image_id);
    paths.push_back(workspace.ImagePath(static_cast<int>(i)).string());
    const phi::Pinhole& k = view.camera.pinhole;
    cameras.insert(cameras.end(), {k.fx, k.fy, k.cx, k.cy});
    const phi::Pose& pose = view.camera.pose;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) poses.push_back(pose.rotation(row, column));
      poses.push_back(pose.translation[row]);
    }
    poses.insert(poses.end(), {0, 0, 0, 1});
  }
  for (std::size_t p = 0; p < scene.num_points(); ++p) {
    const Eigen::Vector3d& point = scene.point(p);
    points.insert(points.end(), point.data(), point.data() + 3);
    for (const phi::PointObservation& seen : scene.track(p)) {
      observations.insert(observations.end(), {static_cast<double>(p), static_cast<double>(seen.view), seen.u, seen.v});
    }
  }
  const std::size_t n = names.size(), m = observations.size() / 4;
  return nb::make_tuple(names, ids, paths, MakeOutput(std::move(cameras), {n, 4}), MakeOutput(std::move(poses), {n, 4, 4}),
                        MakeOutput(std::move(points), {scene.num_points(), 3}),
                        MakeOutput(std::move(observations), {m, 4}));
}

}  // namespace

colmap_ext::Workspace WorkspaceOf(const Scene& scene, int max_image_size) {
  std::vector<colmap_ext::MemoryImage> images(scene.names.size());
  tbb::parallel_for(std::size_t{0}, images.size(), [&](std::size_t i) {
    images[i].pose = PoseOf(scene.poses.data() + 16 * i);
    SetPhoto(scene.images[i], scene.sizes[i], &images[i]);
    if (!scene.masks[i]) return;
    auto mask = std::make_shared<phi::ImageMask>(scene.sizes[i].first, scene.sizes[i].second);
    std::memcpy(mask->data(), scene.masks[i]->data(), mask->bytes());
    images[i].mask = std::move(mask);
  });
  return colmap_ext::Workspace(ModelOf(scene), std::move(images), max_image_size);
}

void BindScene(nb::module_& module) {
  nb::class_<Scene>(module, "Scene")
      .def("__init__",
           [](Scene* scene, std::vector<std::string> names, std::vector<std::uint32_t> ids,
              std::vector<std::pair<int, int>> sizes, Doubles cameras, Doubles poses,
              std::vector<std::optional<Bytes>> images, std::vector<std::optional<Bytes>> masks, Doubles points,
              Doubles observations) {
             new (scene) Scene{std::move(names), std::move(ids),    std::move(sizes),  cameras,     poses,
                               std::move(images), std::move(masks), std::move(points), observations};
           });
  module.def("read_scene", &ReadScene);
}

}  // namespace phimvs_python

#include "colmap_ext/synthetic/room.h"

#include <cstdio>
#include <utility>

#include "colmap_ext/synthetic/room_geometry.h"
#include "colmap_ext/synthetic/sensor.h"
#include "colmap_ext/synthetic/sparse_points.h"
#include "colmap_ext/text_stream.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

template <typename Value>
std::string Refuse(const std::string& option, const Value& value, const std::string& rule) {
  TextOutput message;
  message << "--" << option << " is " << value << "; it must be " << rule;
  return message.str();
}

std::string ViewName(int index, int jpeg_quality) {
  char name[32];
  std::snprintf(name, sizeof(name), "room%04d.%s", index, jpeg_quality == 0 ? "png" : "jpg");
  return name;
}

// One view's share of the room, before it is gathered in order.
struct DevelopedView {
  TracedView traced;
  ColorImage color;
  std::vector<std::uint8_t> file;
};

DevelopedView TakePicture(const std::vector<Shape>& shapes, const phi::SceneView& view,
                          const SyntheticRoomOptions& options) {
  DevelopedView developed;
  developed.traced = TraceView(shapes, view.camera, options.supersampling);
  SensorOptions sensor;
  sensor.key = {options.seed, view.image_id};
  const float jitter = phi::SymmetricFloat(phi::Philox(sensor.key, 0, 1, 0).v[0]);
  sensor.gain = 1 + options.exposure_jitter * jitter;
  sensor.noise_sigma = options.noise_sigma;
  developed.color = Develop(developed.traced.radiance, sensor);
  developed.file = EncodeImage(developed.color, options.jpeg_quality);
  return developed;
}

void Append(DevelopedView developed, SyntheticRoom* room) {
  RenderedScene& scene = room->scene;
  scene.images.push_back(std::make_shared<phi::GrayImage>(DecodeGray(developed.file)));
  scene.truth.push_back(std::make_shared<phi::PlaneMap>(std::move(developed.traced.truth)));
  scene.textured.push_back(std::make_shared<phi::Mask>(std::move(developed.traced.textured)));
  scene.surfaces.push_back(std::make_shared<phi::Array2D<SurfaceId>>(std::move(developed.traced.surfaces)));
  room->image_files.push_back(std::move(developed.file));
}

}  // namespace

std::string SyntheticRoomOptions::Check() const {
  if (width < 16 || width > 16384) return Refuse("width", width, "from 16 to 16384 pixels");
  if (height < 16 || height > 16384) return Refuse("height", height, "from 16 to 16384 pixels");
  if (num_views < 1 || num_views > 10000) return Refuse("num_views", num_views, "from 1 to 10000");
  if (!(texture_share >= 0 && texture_share <= 1))
    return Refuse("texture_share", texture_share, "from 0 to 1");
  if (!(noise_sigma >= 0 && noise_sigma <= 100))
    return Refuse("noise_sigma", noise_sigma, "from 0 to 100 grey levels");
  if (!(exposure_jitter >= 0 && exposure_jitter < 1)) {
    return Refuse("exposure_jitter", exposure_jitter, "at least 0 and less than 1");
  }
  if (jpeg_quality < 0 || jpeg_quality > 100) {
    return Refuse("jpeg_quality", jpeg_quality, "from 1 to 100 percent, or 0 for PNG");
  }
  if (supersampling < 1 || supersampling > 16) return Refuse("supersampling", supersampling, "from 1 to 16");
  return "";
}

SyntheticRoom MakeSyntheticRoom(const SyntheticRoomOptions& options) {
  if (const std::string error = options.Check(); !error.empty()) throw phi::UsageError(error);
  const std::vector<phi::Camera> cameras = RoomCameras(options.num_views, options.width, options.height);
  // Finest lattice of the textures: 1.5 pixels at the middle of the room.
  const double texture_spacing = 1.5 * kTypicalRoomDepth / cameras.front().pinhole.fx;
  const std::vector<Shape> shapes =
      PaintRoom(FurnishRoom(texture_spacing, options.seed), cameras, options.texture_share);

  SyntheticRoom room;
  for (int i = 0; i < options.num_views; ++i) {
    phi::SceneView view;
    view.name = ViewName(i, options.jpeg_quality);
    view.image_id = i + 1;
    view.camera = cameras[i];
    room.scene.views.push_back(view);
  }
  std::vector<ColorImage> color_images;
  for (const phi::SceneView& view : room.scene.views) {
    phi::ThrowIfCancelled();
    DevelopedView developed = TakePicture(shapes, view, options);
    color_images.push_back(std::move(developed.color));
    Append(std::move(developed), &room);
  }
  SparsePointOptions sparse;
  sparse.seed = options.seed;
  room.model = MakeSparseModel(shapes, room.scene, color_images, sparse);
  return room;
}

void Transform(const Similarity& new_from_old, SyntheticRoom* room) {
  Transform(new_from_old, &room->scene);
  for (std::size_t i = 0; i < room->model.images.size(); ++i) {
    const phi::Pose& pose = room->scene.views[i].camera.pose;
    room->model.images[i].rotation = Eigen::Quaterniond(pose.rotation).normalized();
    room->model.images[i].translation = pose.translation;
  }
  for (SparsePoint& point : room->model.points) point.xyz = new_from_old * point.xyz;
}

}  // namespace colmap_ext

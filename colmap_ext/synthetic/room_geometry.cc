#include "colmap_ext/synthetic/room_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace colmap_ext {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kWidth = 5.2, kFront = -0.6, kBack = 4.0, kHeight = 2.7;  // metres
constexpr double kNone = std::numeric_limits<double>::infinity();

Matrix3d AboutX(double degrees) {
  return Eigen::AngleAxisd(degrees * M_PI / 180, Vector3d::UnitX()).toRotationMatrix();
}
Matrix3d AboutZ(double degrees) {
  return Eigen::AngleAxisd(degrees * M_PI / 180, Vector3d::UnitZ()).toRotationMatrix();
}

// Of an item: its box's centre and half size in metres, and how it is turned.
struct Placement {
  Vector3d center, half_size;
  Matrix3d world_from_local;
};

// Adds items with a texture of the room's finest spacing and seeds of their own.
class Furnisher {
 public:
  Furnisher(double texture_spacing, std::uint32_t seed) : spacing_(texture_spacing), seed_(seed) {}

  SolidTexture Texture(const Radiance& dark, const Radiance& light, double coarsest = 0.3) {
    SolidTexture texture;
    texture.dark = dark;
    texture.light = light;
    texture.finest_spacing = spacing_;
    texture.coarsest_spacing = coarsest;
    texture.seed = seed_ * 1024 + static_cast<std::uint32_t>(items_.size());
    return texture;
  }

  // Grain along `axis` of the object's frame.
  SolidTexture Wood(const Radiance& dark, const Radiance& light, int axis) {
    SolidTexture texture = Texture(dark, light, 0.12);
    texture.stretch[axis] = 4;
    return texture;
  }

  Shape& Add(const std::string& name, ShapeKind kind, const Placement& place, const SolidTexture& texture,
             const Radiance& paint) {
    RoomItem item;
    item.shape = {name, kind, place.half_size, place.world_from_local, place.center, texture, {}};
    item.paint.color = paint;
    item.paint.seed = seed_ * 1024 + 512 + static_cast<std::uint32_t>(items_.size());
    item.paint_axis = kind == ShapeKind::kRectangle ? 1 : 2;
    items_.push_back(item);
    return items_.back().shape;
  }

  // A box that stands on z = `floor` with its lower face's centre at (x, y).
  void Stand(const std::string& name, const Vector3d& base, const Vector3d& size, const SolidTexture& texture,
             const Radiance& paint, double turn_degrees = 0) {
    Add(name, ShapeKind::kBox, {base + Vector3d(0, 0, size.z() / 2), size / 2, AboutZ(turn_degrees)}, texture,
        paint);
  }

  std::vector<RoomItem> Take() { return std::move(items_); }

 private:
  double spacing_;
  std::uint32_t seed_;
  std::vector<RoomItem> items_;
};

const Radiance kWarmWhite{214, 208, 196}, kPaleBlue{186, 200, 210}, kCeilingWhite{222, 221, 216};
const Radiance kDarkOak{72, 46, 26}, kOak{186, 140, 92}, kPine{222, 186, 138};

// Walls and ceiling. Their frames' y axis points up (or along the slope), so that partial paint begins above
// a dado.
void AddShell(Furnisher* room) {
  const double middle_y = (kFront + kBack) / 2, half_depth = (kBack - kFront) / 2;
  const auto wallpaper = [&](const Radiance& dark, const Radiance& light) {
    return room->Texture(dark, light, 0.2);
  };
  const Matrix3d back = FrameFromNormal(-Vector3d::UnitY(), Vector3d::UnitX());
  const Matrix3d left = FrameFromNormal(Vector3d::UnitX(), Vector3d::UnitY());
  const Matrix3d right = FrameFromNormal(-Vector3d::UnitX(), -Vector3d::UnitY());
  const Matrix3d ceiling = FrameFromNormal(-Vector3d::UnitZ(), Vector3d::UnitX());
  room->Add("ceiling", ShapeKind::kRectangle,
            {{kWidth / 2, middle_y, kHeight}, {kWidth / 2, half_depth, 0}, ceiling},
            wallpaper({150, 148, 140}, {226, 224, 218}), kCeilingWhite);
  room->Add("back wall", ShapeKind::kRectangle,
            {{kWidth / 2, kBack, kHeight / 2}, {kWidth / 2, kHeight / 2, 0}, back},
            wallpaper({120, 105, 90}, {226, 214, 196}), kWarmWhite);
  room->Add("left wall", ShapeKind::kRectangle,
            {{0, middle_y, kHeight / 2}, {half_depth, kHeight / 2, 0}, left},
            wallpaper({96, 112, 124}, {200, 214, 222}), kPaleBlue);
  room->Add("front wall", ShapeKind::kRectangle,
            {{kWidth / 2, kFront, kHeight / 2},
             {kWidth / 2, kHeight / 2, 0},
             FrameFromNormal(Vector3d::UnitY(), -Vector3d::UnitX())},
            wallpaper({120, 105, 90}, {226, 214, 196}), kWarmWhite);
  // From (x = width, z = 1.3) up to (x = width - 1.5, z = 2.8), leaning over the right side.
  const Vector3d slope_normal = Vector3d(-1, 0, -1).normalized();
  SolidTexture panels = room->Wood({130, 92, 56}, {232, 196, 148}, 0);
  panels.tile_size = {kNone, 0.141, kNone};
  panels.tile_contrast = 0.4;
  room->Add("sloping ceiling", ShapeKind::kRectangle,
            {{kWidth - 0.75, middle_y, 2.05},
             {half_depth, 1.06, 0},
             FrameFromNormal(slope_normal, -Vector3d::UnitY())},
            panels, {206, 198, 184});
  room->Add("right wall", ShapeKind::kRectangle,
            {{kWidth, middle_y, kHeight / 2}, {half_depth, kHeight / 2, 0}, right},
            wallpaper({126, 84, 72}, {222, 182, 160}), {200, 178, 164});
}

// Cabinet work that is often painted.
void AddCabinets(Furnisher* room) {
  room->Stand("sideboard", {3.55, 3.74, 0}, {1.5, 0.5, 0.78}, room->Wood({150, 140, 126}, {232, 226, 214}, 0),
              {228, 224, 214});
  room->Stand("back skirting", {kWidth / 2, kBack - 0.01, 0}, {kWidth, 0.02, 0.09},
              room->Wood({150, 146, 138}, {236, 232, 226}, 0), {232, 230, 226});
  room->Stand("left skirting", {0.01, (kFront + kBack) / 2, 0}, {0.02, kBack - kFront, 0.09},
              room->Wood({150, 146, 138}, {236, 232, 226}, 1), {232, 230, 226});
  room->Stand("door", {0.02, 2.35, 0}, {0.05, 0.9, 2.05}, room->Wood(kOak, {236, 206, 160}, 2),
              {224, 222, 216});
}

void AddFloor(Furnisher* room) {
  SolidTexture planks = room->Wood({98, 64, 38}, {206, 160, 110}, 1);
  planks.tile_size = {0.163, 1.37, kNone};
  planks.tile_contrast = 0.35;
  room->Add(
      "floor", ShapeKind::kRectangle,
      {{kWidth / 2, (kFront + kBack) / 2, 0}, {kWidth / 2, (kBack - kFront) / 2, 0}, Matrix3d::Identity()},
      planks, {150, 140, 128});
  room->Stand("rug", {2.2, 2.15, 0}, {1.9, 1.3, 0.015}, room->Texture({110, 34, 38}, {226, 186, 150}, 0.22),
              {150, 80, 76}, 8);
}

void AddSofa(Furnisher* room) {
  const Radiance dark{42, 58, 84}, light{142, 164, 192}, paint{96, 112, 140};
  const auto fabric = [&] { return room->Texture(dark, light, 0.1); };
  room->Stand("sofa seat", {1.45, 3.45, 0}, {2.0, 0.75, 0.42}, fabric(), paint);
  room->Stand("sofa back", {1.45, 3.85, 0}, {2.0, 0.26, 0.88}, fabric(), paint);
  room->Add("cushion", ShapeKind::kBox, {{0.95, 3.6, 0.64}, {0.27, 0.05, 0.22}, AboutZ(10) * AboutX(-20)},
            room->Texture({140, 92, 20}, {244, 208, 120}, 0.08), {200, 160, 70});
}

void AddPictures(Furnisher* room) {
  const auto hang = [&](const std::string& name, double x, double z, double width, double height,
                        const SolidTexture& canvas) {
    room->Stand(name + " frame", {x, kBack - 0.02, z}, {width + 0.1, 0.04, height + 0.1},
                room->Wood({40, 28, 20}, {120, 92, 64}, 0), {60, 50, 44});
    room->Stand(name, {x, kBack - 0.03, z + 0.05}, {width, 0.04, height}, canvas, {170, 170, 160});
  };
  hang("landscape", 1.5, 1.3, 1.0, 0.62, room->Texture({28, 62, 66}, {236, 218, 170}, 0.25));
  hang("portrait", 3.1, 1.15, 0.5, 0.72, room->Texture({66, 30, 60}, {232, 196, 150}, 0.18));
  // A mirror-sized panel of figured wood that leans on the right part of the back wall.
  room->Add("leaning panel", ShapeKind::kBox,
            {{4.62, 3.72, 0.62}, {0.26, 0.015, 0.63}, AboutZ(-12) * AboutX(-17)},
            room->Wood(kDarkOak, kPine, 2), {120, 90, 66});
}

// Few and large things before textured ones: at 480 x 360 pixels a matching window covers 10 cm of the back wall, and
// what lies within a window of a depth edge is hard for every method.
void AddTableAndPlants(Furnisher* room) {
  room->Stand("low chest", {2.3, 2.35, 0}, {1.3, 0.75, 0.4}, room->Wood({120, 80, 46}, kPine, 0),
              {196, 170, 140}, 8);
  room->Add("globe", ShapeKind::kSphere, {{2.62, 2.4, 0.59}, Vector3d::Constant(0.19), Matrix3d::Identity()},
            room->Texture({30, 70, 130}, {226, 222, 160}, 0.16), {110, 140, 150});
  room->Add("vase", ShapeKind::kCylinder, {{3.15, 3.72, 0.96}, {0.12, 0.12, 0.18}, Matrix3d::Identity()},
            room->Texture({36, 66, 60}, {190, 224, 200}, 0.1), {130, 170, 150});
  room->Add("plant pot", ShapeKind::kCylinder, {{4.3, 2.85, 0.3}, {0.22, 0.22, 0.3}, Matrix3d::Identity()},
            room->Texture({126, 62, 38}, {230, 168, 128}, 0.12), {190, 120, 90});
  room->Add("plant crown", ShapeKind::kSphere,
            {{4.3, 2.85, 0.88}, Vector3d::Constant(0.36), Matrix3d::Identity()},
            room->Texture({20, 52, 18}, {150, 200, 96}, 0.09), {90, 130, 60});
  // A row of books is one box whose pattern changes from cover to cover.
  SolidTexture covers = room->Texture({96, 28, 30}, {226, 190, 120}, 0.06);
  covers.tile_size = {0.047, kNone, kNone};
  covers.tile_contrast = 0.5;
  room->Stand("books", {3.8, 3.8, 0.78}, {0.5, 0.2, 0.26}, covers, {150, 120, 90});
}

phi::Pose LookAt(const Vector3d& center, const Vector3d& target, double roll) {
  const Vector3d forward = (target - center).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  Matrix3d upright;
  upright << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  phi::Pose pose;
  pose.rotation = AboutZ(roll) * upright;
  pose.translation = -pose.rotation * center;
  return pose;
}

}  // namespace

std::vector<RoomItem> FurnishRoom(double texture_spacing, std::uint32_t seed) {
  Furnisher room(texture_spacing, seed);
  AddShell(&room);
  AddCabinets(&room);
  AddFloor(&room);
  AddSofa(&room);
  AddPictures(&room);
  AddTableAndPlants(&room);
  return room.Take();
}

std::vector<phi::Camera> RoomCameras(int num_views, int width, int height) {
  constexpr double kSpacing = 0.3, kMaxSpan = 3.0;  // metres between neighbours, and in all
  const double span = std::min(kSpacing * (num_views - 1), kMaxSpan);
  std::vector<phi::Camera> cameras(num_views);
  for (int i = 0; i < num_views; ++i) {
    const double s = num_views > 1 ? static_cast<double>(i) / (num_views - 1) - 0.5 : 0;
    const Vector3d center(2.4 + span * s, -0.1 + 0.25 * s * s, 1.5 + (i % 2 ? 0.16 : -0.16));
    const Vector3d target(2.5 + 0.3 * s, 3.2, 1.12);
    cameras[i].pose = LookAt(center, target, 1.5 * ((i * 2) % 3 - 1));
    cameras[i].pinhole = {width, height, 0.85 * width, 0.853 * width, 0.497 * width, 0.504 * height};
  }
  return cameras;
}

}  // namespace colmap_ext

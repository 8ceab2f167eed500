// The furnished room: 5.2 x 4.6 x 2.7 m with a sloping ceiling. World frame: x right, y into the room, z up;
// metres.
#pragma once

#include <cstdint>
#include <vector>

#include "colmap_ext/synthetic/shape.h"
#include "phi/geometry/camera.h"

namespace colmap_ext {

// A surface of the room that bears its texture, or else a coat of paint.
struct RoomItem {
  Shape shape;  // with its texture
  Paint paint;  // what it bears when it is painted
  int paint_axis =
      1;  // of the shape's frame: a partly painted item is painted above some coordinate on this axis
};

// In the order in which the room is painted: the ceiling and the back wall first, small textured things last.
// texture_spacing: finest lattice spacing of the textures, metres.
std::vector<RoomItem> FurnishRoom(double texture_spacing, std::uint32_t seed);

// Cameras side by side near the front wall, alternating in height, that look into the room.
std::vector<phi::Camera> RoomCameras(int num_views, int width, int height);

// Distance from the cameras to the middle of the room, metres.
inline constexpr double kTypicalRoomDepth = 3.3;

// Paints items in their order until `texture_share` of all the views' pixels bear texture; the item that
// crosses the share is painted in part.
std::vector<Shape> PaintRoom(const std::vector<RoomItem>& items, const std::vector<phi::Camera>& cameras,
                             double texture_share);

}  // namespace colmap_ext

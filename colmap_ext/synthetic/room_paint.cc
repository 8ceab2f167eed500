// Which of the room's surfaces are painted, so that the stated share of the pixels bears texture.
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "colmap_ext/synthetic/ray_tracer.h"
#include "colmap_ext/synthetic/room_geometry.h"

namespace colmap_ext {
namespace {

constexpr int kStep = 3;  // pixels between the rays that measure the shares

// Per item, the coordinate on its paint axis of every hit, over all views.
std::vector<std::vector<double>> CollectHits(const std::vector<RoomItem>& items,
                                             const std::vector<Shape>& shapes,
                                             const std::vector<phi::Camera>& cameras) {
  std::vector<std::vector<double>> hits(items.size());
  for (const phi::Camera& camera : cameras) {
    for (int y = kStep / 2; y < camera.pinhole.height; y += kStep) {
      for (int x = kStep / 2; x < camera.pinhole.width; x += kStep) {
        const Hit hit = Intersect(shapes, PixelRay(camera, x + 0.5, y + 0.5));
        if (hit.valid()) hits[hit.shape].push_back(hit.local[items[hit.shape].paint_axis]);
      }
    }
  }
  return hits;
}

}  // namespace

std::vector<Shape> PaintRoom(const std::vector<RoomItem>& items, const std::vector<phi::Camera>& cameras,
                             double texture_share) {
  std::vector<Shape> shapes;
  for (const RoomItem& item : items) shapes.push_back(item.shape);
  std::vector<std::vector<double>> hits = CollectHits(items, shapes, cameras);
  std::size_t total = 0;
  for (const auto& h : hits) total += h.size();

  std::size_t to_paint = static_cast<std::size_t>(std::llround((1 - texture_share) * total));
  for (std::size_t i = 0; i < items.size() && to_paint > 0; ++i) {
    if (hits[i].size() <= to_paint) {
      shapes[i].material = items[i].paint;
      to_paint -= hits[i].size();
      continue;
    }
    std::nth_element(hits[i].begin(), hits[i].begin() + to_paint, hits[i].end(), std::greater<double>());
    shapes[i].partial_paint = Shape::PartialPaint{items[i].paint_axis, hits[i][to_paint], items[i].paint};
    to_paint = 0;
  }
  return shapes;
}

}  // namespace colmap_ext

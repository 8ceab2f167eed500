// The convex hull of places in an image.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace phi {

struct Place {
  double x, y;
};

// Twice the area of a, b, c; positive where they turn to the left.
inline double Turn(const Place& a, const Place& b, const Place& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

class ConvexHull {
 public:
  // Corners in order (Andrew's monotone chain).
  explicit ConvexHull(std::vector<Place> places) {
    std::sort(places.begin(), places.end(),
              [](const Place& a, const Place& b) { return std::pair(a.x, a.y) < std::pair(b.x, b.y); });
    const auto add = [&](const Place& place, std::size_t kept) {
      while (corners_.size() >= kept + 2 && Turn(corners_[corners_.size() - 2], corners_.back(), place) <= 0) corners_.pop_back();
      corners_.push_back(place);
    };
    for (const Place& place : places) add(place, 0);
    if (corners_.empty()) return;
    const std::size_t lower = corners_.size() - 1;
    for (std::size_t i = places.size(); i-- > 0;) add(places[i], lower);
    corners_.pop_back();
  }

  bool Contains(const Place& place) const {
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (Turn(corners_[i], corners_[(i + 1) % corners_.size()], place) < 0) return false;
    }
    return corners_.size() > 2;
  }

 private:
  std::vector<Place> corners_;
};

}  // namespace phi

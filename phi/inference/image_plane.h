// Planes in an image, through anchors: points with x, y (array indices), w (inverse depth) and the tolerance of w.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace phi {

// 1 / z = a + b * x + c * y at array indices (x, y) of the reference image.
struct ImagePlane {
  double a = 0, b = 0, c = 0;

  double InverseDepth(double x, double y) const { return a + b * x + c * y; }
};

// `Surface`: a plane, or a bent one (region_plane.h).
template <typename Surface = ImagePlane, typename Anchor>
bool IsOn(const Surface& surface, const Anchor& anchor) {
  return std::abs(surface.InverseDepth(anchor.x, anchor.y) - anchor.w) < anchor.tolerance;
}

// Whether the anchor lies behind the plane by more than `apart`, relative.
template <typename Anchor>
bool IsBehind(const ImagePlane& plane, const Anchor& anchor, double apart) {
  return anchor.w < (1 - apart) * plane.InverseDepth(anchor.x, anchor.y);
}

// False: twice the area of their triangle is less than `min_area`, square pixels.
template <typename Anchor>
bool PlaneThrough(const Anchor& p, const Anchor& q, const Anchor& r, double min_area, ImagePlane* plane) {
  const double px = p.x, py = p.y;
  const double x1 = q.x - px, y1 = q.y - py, x2 = r.x - px, y2 = r.y - py;
  const double det = x1 * y2 - x2 * y1;
  if (std::abs(det) < min_area) return false;
  const double pw = p.w, w1 = q.w - pw, w2 = r.w - pw;
  plane->b = (w1 * y2 - w2 * y1) / det;
  plane->c = (w2 * x1 - w1 * x2) / det;
  plane->a = pw - plane->b * px - plane->c * py;
  return true;
}

// Least squares over anchors. Coordinates relative to one of them keep the equations well scaled.
class PlaneFit {
 public:
  PlaneFit(double center_x, double center_y) : cx_(center_x), cy_(center_y) {}

  template <typename Anchor>
  void Add(const Anchor& anchor, double weight = 1) {
    ++count_;
    const double x = anchor.x - cx_, y = anchor.y - cy_, w = weight * anchor.w;
    sum_ += weight, x_ += weight * x, y_ += weight * y;
    xx_ += weight * x * x, xy_ += weight * x * y, yy_ += weight * y * y;
    w_ += w, wx_ += w * x, wy_ += w * y;
  }

  int count() const { return count_; }

  // Of the anchors that were added, which do not lie in a line.
  void Solve(ImagePlane* plane) const;

  // Of the anchors' places, each by its weight.
  Eigen::Vector2d Mean() const { return Eigen::Vector2d(cx_, cy_) + RelativeMean(); }
  Eigen::Matrix2d Covariance() const;
  // Across the narrow side of where the anchors lie: the smaller eigenvalue of the covariance.
  double NarrowVariance() const;

 private:
  Eigen::Vector2d RelativeMean() const { return Eigen::Vector2d(x_, y_) / sum_; }

  double cx_, cy_;
  int count_ = 0;
  // Weighted sums; coordinates relative to the centre.
  double sum_ = 0, x_ = 0, y_ = 0, xx_ = 0, xy_ = 0, yy_ = 0, w_ = 0, wx_ = 0, wy_ = 0;
};

}  // namespace phi

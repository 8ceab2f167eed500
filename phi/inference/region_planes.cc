#include "phi/inference/region_planes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include <tbb/parallel_for.h>
#include <Eigen/Dense>

#include "phi/base/random.h"

namespace phi {
namespace {

constexpr int kMaxStep = 18;      // between neighbours of one region, in ninths of a grey level (3 x 3 sums)
constexpr int kMinSupports = 60;  // measured pixels that a plane rests on
constexpr double kMinShare = 0.15;    // of the region's measured pixels not yet explained
constexpr double kTolerance = 0.006;  // of an inlier, relative inverse depth
constexpr int kNumDraws = 100;
constexpr std::size_t kMaxScored = 1500;  // supports that a draw is scored on
constexpr double kMinSpread = 3;          // standard deviation across the inliers' narrow side, pixels
constexpr double kBoxMargin = 0.25;       // of the inliers' box's longer side

struct Point {
  int x, y;
  double w;
};

Array2D<std::int32_t> BoxSums(const GrayImage& image) {
  Array2D<std::int32_t> sums(image.width(), image.height(), 0);
  tbb::parallel_for(0, image.height(), [&](int y) {
    for (int x = 0; x < image.width(); ++x) {
      for (int v = y - 1; v <= y + 1; ++v) {
        for (int u = x - 1; u <= x + 1; ++u) {
          sums(x, y) += image(std::clamp(u, 0, image.width() - 1), std::clamp(v, 0, image.height() - 1));
        }
      }
    }
  });
  return sums;
}

// Root of a pixel's region: its smallest index. Path halving.
std::int32_t Find(Array2D<std::int32_t>* parents, std::int32_t i) {
  std::int32_t* parent = parents->data();
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

void Join(Array2D<std::int32_t>* parents, std::int32_t a, std::int32_t b) {
  const std::int32_t root_a = Find(parents, a), root_b = Find(parents, b);
  parents->data()[std::max(root_a, root_b)] = std::min(root_a, root_b);
}

Array2D<std::int32_t> ConnectedRegions(const GrayImage& image) {
  const Array2D<std::int32_t> sums = BoxSums(image);
  const int width = image.width(), height = image.height();
  Array2D<std::int32_t> parents(width, height);
  std::iota(parents.begin(), parents.end(), 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::int32_t i = y * width + x;
      if (x + 1 < width && std::abs(sums(x, y) - sums(x + 1, y)) <= kMaxStep) Join(&parents, i, i + 1);
      if (y + 1 < height && std::abs(sums(x, y) - sums(x, y + 1)) <= kMaxStep) Join(&parents, i, i + width);
    }
  }
  for (std::size_t i = 0; i < parents.size(); ++i) {
    parents.data()[i] = Find(&parents, static_cast<std::int32_t>(i));
  }
  return parents;
}

bool IsInlier(const RegionPlane& plane, const Point& p) {
  return std::abs(plane.a + plane.b * p.x + plane.c * p.y - p.w) < kTolerance * p.w;
}

bool PlaneThrough(const Point& p, const Point& q, const Point& r, RegionPlane* plane) {
  const double x1 = q.x - p.x, y1 = q.y - p.y, x2 = r.x - p.x, y2 = r.y - p.y;
  const double det = x1 * y2 - x2 * y1;
  if (std::abs(det) < 100) return false;  // twice the triangle's area, square pixels
  plane->b = ((q.w - p.w) * y2 - (r.w - p.w) * y1) / det;
  plane->c = ((r.w - p.w) * x1 - (q.w - p.w) * x2) / det;
  plane->a = p.w - plane->b * p.x - plane->c * p.y;
  return true;
}

// Least squares over the inliers; false when they do not carry a plane. Sets the box.
bool Refine(const std::vector<Point>& points, RegionPlane* plane) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double cx = points[0].x, cy = points[0].y;  // relative coordinates keep the equations well scaled
  int x0 = points[0].x, y0 = points[0].y, x1 = x0, y1 = y0, n = 0;
  for (const Point& p : points) {
    if (!IsInlier(*plane, p)) continue;
    if (n++ == 0) x0 = x1 = p.x, y0 = y1 = p.y;
    const Eigen::Vector3d row(1, p.x - cx, p.y - cy);
    normal += row * row.transpose();
    right += p.w * row;
    x0 = std::min(x0, p.x), x1 = std::max(x1, p.x);
    y0 = std::min(y0, p.y), y1 = std::max(y1, p.y);
  }
  if (n < kMinSupports) return false;
  const Eigen::Vector2d mean = normal.block<2, 1>(1, 0) / n;
  const Eigen::Matrix2d covariance = normal.block<2, 2>(1, 1) / n - mean * mean.transpose();
  const double narrow = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance).eigenvalues()(0);
  if (!(narrow > kMinSpread * kMinSpread)) return false;
  const Eigen::Vector3d solution = normal.ldlt().solve(right);
  plane->b = solution(1);
  plane->c = solution(2);
  plane->a = solution(0) - solution(1) * cx - solution(2) * cy;
  const int margin = static_cast<int>(kBoxMargin * std::max(x1 - x0, y1 - y0));
  plane->x0 = x0 - margin, plane->y0 = y0 - margin;
  plane->x1 = x1 + margin, plane->y1 = y1 + margin;
  return true;
}

// The plane that most of the points agree on.
bool FitPlane(const std::vector<Point>& points, RandomKey key, std::uint64_t region, std::uint32_t round,
              RegionPlane* best) {
  const std::size_t stride = (points.size() + kMaxScored - 1) / kMaxScored;
  std::size_t best_count = 0;
  for (int draw = 0; draw < kNumDraws; ++draw) {
    const Random4 random = Philox(key, region, round, static_cast<std::uint32_t>(draw));
    RegionPlane plane;
    if (!PlaneThrough(points[random.v[0] % points.size()], points[random.v[1] % points.size()],
                      points[random.v[2] % points.size()], &plane)) {
      continue;
    }
    std::size_t count = 0;
    for (std::size_t i = 0; i < points.size(); i += stride) count += IsInlier(plane, points[i]);
    if (count > best_count) best_count = count, *best = plane;
  }
  if (best_count * stride < kMinShare * points.size()) return false;
  return Refine(points, best) && Refine(points, best);
}

std::array<RegionPlane, kPlanesPerRegion> FitPlanes(std::vector<Point> points, RandomKey key,
                                                    std::uint64_t region) {
  std::array<RegionPlane, kPlanesPerRegion> planes{};
  for (int k = 0; k < kPlanesPerRegion && points.size() >= kMinSupports; ++k) {
    RegionPlane plane;
    if (!FitPlane(points, key, region, static_cast<std::uint32_t>(k), &plane)) break;
    planes[k] = plane;
    std::erase_if(points, [&](const Point& p) { return IsInlier(plane, p); });
  }
  return planes;
}

}  // namespace

RegionPlanes::RegionPlanes(const GrayImage& image, ArrayView2D<const Support> supports,
                           std::uint32_t image_id)
    : region_(ConnectedRegions(image)) {
  std::vector<std::vector<Point>> points;
  std::vector<std::int32_t> roots, index(region_.size(), -1);
  std::vector<std::int32_t> count(region_.size(), 0);
  for (std::size_t i = 0; i < region_.size(); ++i) count[region_.data()[i]] += supports.data[i].value > 0;
  for (int y = 0; y < region_.height(); ++y) {
    for (int x = 0; x < region_.width(); ++x) {
      const std::int32_t root = region_(x, y);
      if (count[root] < kMinSupports) continue;
      if (index[root] < 0) {
        index[root] = static_cast<std::int32_t>(roots.size());
        roots.push_back(root);
        points.emplace_back();
      }
      if (supports(x, y).value > 0) points[index[root]].push_back({x, y, supports(x, y).value});
    }
  }
  for (std::int32_t& region : region_) region = index[region];
  planes_.resize(roots.size());
  tbb::parallel_for(std::size_t{0}, roots.size(), [&](std::size_t r) {
    planes_[r] = FitPlanes(std::move(points[r]), {0, image_id}, static_cast<std::uint64_t>(roots[r]));
  });
}

const std::array<RegionPlane, kPlanesPerRegion>& RegionPlanes::At(int x, int y) const {
  static const std::array<RegionPlane, kPlanesPerRegion> kNone{};
  const std::int32_t region = region_(x, y);
  return region < 0 ? kNone : planes_[region];
}

}  // namespace phi

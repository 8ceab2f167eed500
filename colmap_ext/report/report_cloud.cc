#include "colmap_ext/report/report_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/report/report_pictures.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

struct Point {
  std::array<double, 3> xyz;
  std::array<std::uint8_t, 3> rgb;
};

std::vector<Point> ReadEvenly(const PlyRows& rows, std::uint64_t count, int max_points) {
  const std::uint64_t step = std::max<std::uint64_t>(1, (count + max_points - 1) / max_points);
  std::vector<Point> points;
  std::uint64_t index = 0;
  rows.ForEachRow("vertex", {"x", "y", "z", "red", "green", "blue"}, [&](const double* v) {
    if (index++ % step != 0 || !std::isfinite(v[0] + v[1] + v[2])) return;
    Point p{{v[0], v[1], v[2]}, {160, 160, 160}};
    if (std::isfinite(v[3] + v[4] + v[5])) {
      for (int c = 0; c < 3; ++c) p.rgb[c] = static_cast<std::uint8_t>(std::clamp(v[3 + c], 0.0, 255.0));
    }
    points.push_back(p);
  });
  return points;
}

// Centre and half side of a cube around the bulk of the points.
void FindCube(const std::vector<Point>& points, ReportCloud& cloud) {
  constexpr double kQuantile = 0.01, kGrow = 1.5;
  double half = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Point& p : points) values.push_back(p.xyz[axis]);
    std::sort(values.begin(), values.end());
    const auto last = static_cast<double>(values.size() - 1);
    const double lower = values[static_cast<std::size_t>(kQuantile * last)];
    const double upper = values[static_cast<std::size_t>((1 - kQuantile) * last)];
    cloud.center[axis] = (lower + upper) / 2;
    half = std::max(half, (upper - lower) / 2);
  }
  cloud.scale = half > 0 ? kGrow * half : 1;
}

}  // namespace

ReportCloud MakeReportCloud(const std::filesystem::path& ply, int max_points) {
  const PlyRows rows(ply);
  const PlyElement* vertex = rows.Find("vertex");
  if (!vertex) throw phi::InputError(ply.string() + " has no vertices");
  ReportCloud cloud;
  cloud.num_points = vertex->count;
  const std::vector<Point> points = ReadEvenly(rows, vertex->count, max_points);
  if (points.empty()) return cloud;
  FindCube(points, cloud);
  std::string positions, colors;
  for (const Point& p : points) {
    std::int16_t packed[3];
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) {
      const double value = (p.xyz[axis] - cloud.center[axis]) / cloud.scale;
      inside &= std::abs(value) <= 1;
      packed[axis] = static_cast<std::int16_t>(std::lround(32767 * std::clamp(value, -1.0, 1.0)));
    }
    if (!inside) continue;
    positions.append(reinterpret_cast<const char*>(packed), sizeof(packed));
    colors.append(reinterpret_cast<const char*>(p.rgb.data()), 3);
    ++cloud.num_shown;
  }
  cloud.positions = Base64(positions);
  cloud.colors = Base64(colors);
  return cloud;
}

}  // namespace colmap_ext

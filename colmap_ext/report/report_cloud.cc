#include "colmap_ext/report/report_cloud.h"

#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string_view>
#include <utility>

#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/fusion/cloud_files.h"
#include "colmap_ext/report/report_pictures.h"
#include "colmap_ext/visibility_file.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

constexpr std::size_t kMaxListedViews = 255;

// Positions of `wanted` of `count` rows, ascending, each set of them equally likely: draws until so many differ.
std::vector<std::uint64_t> DrawRows(std::uint64_t count, std::uint64_t wanted) {
  std::mt19937_64 random(0);
  std::vector<std::uint64_t> rows;
  while (rows.size() < wanted) {
    for (std::uint64_t i = rows.size(); i < wanted; ++i) rows.push_back(random() % count);
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  }
  return rows;
}

// The same for any share of the rows: beyond half of them, draws those that are left out.
std::vector<std::uint64_t> ChooseRows(std::uint64_t count, std::uint64_t wanted) {
  if (wanted <= count / 2) return DrawRows(count, wanted);
  const std::vector<std::uint64_t> left_out = DrawRows(count, count - wanted);
  std::vector<std::uint64_t> rows;
  auto next = left_out.begin();
  for (std::uint64_t row = 0; row < count; ++row) {
    if (next != left_out.end() && *next == row) {
      ++next;
    } else {
      rows.push_back(row);
    }
  }
  return rows;
}

CloudSample::Point MakePoint(const double* v) {
  CloudSample::Point p;
  p.xyz = {v[0], v[1], v[2]};
  if (std::isfinite(v[3] + v[4] + v[5])) {
    for (int c = 0; c < 3; ++c) p.rgb[c] = static_cast<std::uint8_t>(std::clamp(v[3 + c], 0.0, 255.0));
  }
  if (std::isfinite(v[6] + v[7] + v[8])) {
    for (int axis = 0; axis < 3; ++axis) p.normal[axis] = static_cast<float>(v[6 + axis]);
  }
  p.inferred = v[9] > 0;
  if (std::isfinite(v[10])) p.confidence = static_cast<std::uint8_t>(std::clamp(v[10], 0.0, 100.0));
  return p;
}

// By row: the images that see the point, as indices into the workspace's views; none from where the file is cut short, and
// none where it is not of `num_points` points.
std::vector<std::vector<std::uint16_t>> ReadViews(const std::filesystem::path& path, std::uint64_t num_points,
                                                  const std::vector<std::uint64_t>& rows) {
  std::vector<std::vector<std::uint16_t>> views(rows.size());
  VisibilityReader reader(path);
  if (reader.num_points() != num_points) return views;
  std::vector<std::uint32_t> images;
  std::uint64_t row = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!reader.Skip(rows[i] - row)) return views;
    const bool is_whole = reader.Next(&images);
    row = rows[i] + 1;
    for (const std::uint32_t image : images) {
      if (image <= UINT16_MAX) views[i].push_back(static_cast<std::uint16_t>(image));
    }
    if (!is_whole) return views;
  }
  return views;
}

// Centre and half side of a cube around the bulk of the points.
void FindCube(const std::vector<CloudSample::Point>& points, ReportCloud* cloud) {
  constexpr double kQuantile = 0.01, kGrow = 1.5;
  double half = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const CloudSample::Point& p : points) values.push_back(p.xyz[axis]);
    const auto quantile = [&](double share) {
      const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), place, values.end());
      return *place;
    };
    const double lower = quantile(kQuantile), upper = quantile(1 - kQuantile);
    cloud->center[axis] = (lower + upper) / 2;
    half = std::max(half, (upper - lower) / 2);
  }
  cloud->scale = half > 0 ? kGrow * half : 1;
}

template <typename T>
void AppendValue(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// False, and nothing appended, when the point lies outside the cube.
bool AppendPosition(const CloudSample::Point& p, const ReportCloud& cloud, std::string* positions) {
  std::int16_t packed[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double value = (p.xyz[axis] - cloud.center[axis]) / cloud.scale;
    if (!(std::abs(value) <= 1)) return false;
    packed[axis] = static_cast<std::int16_t>(std::lround(32767 * value));
  }
  positions->append(reinterpret_cast<const char*>(packed), sizeof(packed));
  return true;
}

// The truth at the point's pixel in this image, and the point's own depth; false where there is none.
bool TruthAt(const phi::SceneView& view, const phi::Array2D<float>& truth, const Eigen::Vector3d& world,
             double* depth, double* true_depth) {
  const Eigen::Vector3d in_camera = view.camera.pose * world;
  const phi::Pinhole& k = view.camera.pinhole;
  if (!(in_camera.z() > 0)) return false;
  const Eigen::Vector2d pixel = k.Project(in_camera);
  const double u = pixel.x(), v = pixel.y();
  if (!(u >= 0 && v >= 0 && u < k.width && v < k.height)) return false;
  *depth = in_camera.z();
  *true_depth = truth(static_cast<int>(u * truth.width() / k.width), static_cast<int>(v * truth.height() / k.height));
  return *true_depth > 0;
}

}  // namespace

CloudCount CountCloud(const std::filesystem::path& ply, std::uint64_t num_points_of_first) {
  CloudCount count{.num_points = num_points_of_first, .num_files = EndOfNumberedParts(ply, 2) - 1};
  for (std::size_t number = 2; number <= count.num_files; ++number) {
    const PlyRows rows(NumberedPart(ply, number));
    if (const PlyElement* vertex = rows.Find("vertex")) count.num_points += vertex->count;
  }
  return count;
}

CloudSample SampleCloud(const std::filesystem::path& ply, int max_points) {
  const PlyRows rows(ply);
  const PlyElement* vertex = rows.Find("vertex");
  if (!vertex) throw phi::InputError(phi::AboutFile(ply) + " has no vertices");
  CloudSample sample;
  sample.num_points = vertex->count;
  sample.offset = rows.offset();
  sample.has_normals = vertex->Has("nx");
  sample.has_origin = vertex->Has("inferred");
  const std::vector<std::uint64_t> chosen =
      ChooseRows(vertex->count, std::min<std::uint64_t>(vertex->count, max_points));
  std::vector<std::vector<std::uint16_t>> views;
  // Isolated: a thread that waits here must not take up an image of the report instead.
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_invoke(
        [&] {
          rows.ForChosenRows("vertex", {"x", "y", "z", "red", "green", "blue", "nx", "ny", "nz", "inferred", "confidence"}, chosen,
                             [&](const double* v) { sample.points.push_back(MakePoint(v)); });
        },
        [&] { views = ReadViews(ply.string() + ".vis", sample.num_points, chosen); });
  });
  for (std::size_t i = 0; i < sample.points.size(); ++i) sample.points[i].views = std::move(views[i]);
  // Another program's: they have no place in order, and the cube around the others would have none either.
  std::erase_if(sample.points, [](const CloudSample::Point& p) { return !std::isfinite(p.xyz[0] + p.xyz[1] + p.xyz[2]); });
  return sample;
}

void CompareWithTruth(const Workspace& workspace, const std::map<std::string, std::filesystem::path>& truth,
                      double values_per_unit, CloudSample* sample) {
  for (std::size_t image = 0; image < workspace.views().size(); ++image) {
    const phi::SceneView& view = workspace.views()[image];
    const auto file = truth.find(view.name);
    if (file == truth.end()) continue;
    const phi::Array2D<float> map = ReadTruthDepth(file->second, values_per_unit);
    RequireShapeOfImage(map, file->second, view);
    for (CloudSample::Point& p : sample->points) {
      double depth = 0, true_depth = 0;
      if (p.error != 255 || std::find(p.views.begin(), p.views.end(), image) == p.views.end()) continue;
      const Eigen::Vector3d world = Eigen::Vector3d(p.xyz.data()) + Eigen::Vector3d(sample->offset.data());
      if (!TruthAt(view, map, world, &depth, &true_depth)) continue;
      const double error = std::abs(depth - true_depth) / true_depth;
      p.error = static_cast<std::uint8_t>(std::min(254.0, error / CloudSample::kErrorUnit));
    }
  }
}

ReportCloud PackCloud(const CloudSample& sample) {
  ReportCloud cloud;
  if (sample.points.empty()) return cloud;
  FindCube(sample.points, &cloud);
  std::string positions, colors, normals, inferred, confidences, errors, view_counts, views;
  bool has_confidence = false, has_errors = false;
  for (const CloudSample::Point& p : sample.points) {
    if (!AppendPosition(p, cloud, &positions)) continue;
    colors.append(reinterpret_cast<const char*>(p.rgb.data()), 3);
    for (const float n : p.normal)
      AppendValue(static_cast<std::int8_t>(std::lround(127 * std::clamp(n, -1.0f, 1.0f))), &normals);
    AppendValue(static_cast<std::uint8_t>(p.inferred), &inferred);
    AppendValue(p.confidence, &confidences);
    has_confidence |= p.confidence > 0;
    AppendValue(p.error, &errors);
    has_errors |= p.error != 255;
    const std::size_t num_views = std::min(p.views.size(), kMaxListedViews);
    AppendValue(static_cast<std::uint8_t>(num_views), &view_counts);
    for (std::size_t v = 0; v < num_views; ++v) AppendValue(p.views[v], &views);
    ++cloud.num_shown;
  }
  cloud.positions = Base64(positions);
  cloud.colors = Base64(colors);
  if (sample.has_normals) cloud.normals = Base64(normals);
  if (sample.has_origin) cloud.inferred = Base64(inferred);
  if (has_confidence) cloud.confidences = Base64(confidences);
  if (has_errors) cloud.errors = Base64(errors);
  if (!views.empty()) {
    cloud.view_counts = Base64(view_counts);
    cloud.views = Base64(views);
  }
  return cloud;
}

}  // namespace colmap_ext

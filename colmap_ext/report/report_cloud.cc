#include "colmap_ext/report/report_cloud.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <string_view>

#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/report/report_pictures.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

constexpr std::size_t kMaxListedViews = 255;

// Positions of `wanted` of `count` rows, ascending, each set of them equally likely (selection sampling).
std::vector<std::uint64_t> ChooseRows(std::uint64_t count, std::uint64_t wanted) {
  std::mt19937_64 random(0);
  std::vector<std::uint64_t> rows;
  for (std::uint64_t row = 0; row < count && rows.size() < wanted; ++row) {
    if (random() % (count - row) < wanted - rows.size()) rows.push_back(row);
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
  return p;
}

template <typename T>
T ReadValue(std::ifstream& file) {
  T value{};
  file.read(reinterpret_cast<char*>(&value), sizeof(value));
  return value;
}

// Whose images the file does not tell has no views.
void ReadViews(const std::filesystem::path& path, const std::vector<std::uint64_t>& rows,
               CloudSample* sample) {
  std::ifstream file = OpenRegularFile(path);
  if (!file || ReadValue<std::uint64_t>(file) != sample->num_points) return;
  std::uint64_t row = 0;
  for (std::size_t i = 0; i < rows.size() && file; ++i) {
    for (; row < rows[i] && file; ++row) {
      // Not seekg: it would empty the stream's buffer at every point.
      file.ignore(static_cast<std::streamsize>(sizeof(std::uint32_t)) * ReadValue<std::uint32_t>(file));
    }
    const auto num_views = ReadValue<std::uint32_t>(file);
    for (std::uint32_t v = 0; v < num_views && file; ++v) {
      const auto view = ReadValue<std::uint32_t>(file);
      if (file && view <= UINT16_MAX) sample->points[i].views.push_back(static_cast<std::uint16_t>(view));
    }
    ++row;
  }
}

// Centre and half side of a cube around the bulk of the points.
void FindCube(const std::vector<CloudSample::Point>& points, ReportCloud* cloud) {
  constexpr double kQuantile = 0.01, kGrow = 1.5;
  double half = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const CloudSample::Point& p : points) values.push_back(p.xyz[axis]);
    std::sort(values.begin(), values.end());
    const auto last = static_cast<double>(values.size() - 1);
    const double lower = values[static_cast<std::size_t>(kQuantile * last)];
    const double upper = values[static_cast<std::size_t>((1 - kQuantile) * last)];
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
bool TruthAt(const phi::SceneView& view, const phi::Array2D<float>& truth, const CloudSample::Point& p,
             double* depth, double* true_depth) {
  const Eigen::Vector3d in_camera = view.camera.pose * Eigen::Vector3d(p.xyz[0], p.xyz[1], p.xyz[2]);
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

CloudSample SampleCloud(const std::filesystem::path& ply, int max_points) {
  const PlyRows rows(ply);
  const PlyElement* vertex = rows.Find("vertex");
  if (!vertex) throw phi::InputError(ply.string() + " has no vertices");
  CloudSample sample;
  sample.num_points = vertex->count;
  sample.has_normals = vertex->Has("nx");
  sample.has_origin = vertex->Has("inferred");
  const std::vector<std::uint64_t> chosen =
      ChooseRows(vertex->count, std::min<std::uint64_t>(vertex->count, max_points));
  std::uint64_t row = 0;
  rows.ForEachRow("vertex", {"x", "y", "z", "red", "green", "blue", "nx", "ny", "nz", "inferred"},
                  [&](const double* v) {
                    const std::size_t next = sample.points.size();
                    if (next < chosen.size() && chosen[next] == row) sample.points.push_back(MakePoint(v));
                    ++row;
                  });
  ReadViews(ply.string() + ".vis", chosen, &sample);
  return sample;
}

void CompareWithTruth(const Workspace& workspace, const std::map<std::string, std::filesystem::path>& truth,
                      double values_per_unit, CloudSample* sample) {
  for (std::size_t image = 0; image < workspace.views().size(); ++image) {
    const phi::SceneView& view = workspace.views()[image];
    const auto file = truth.find(view.name);
    if (file == truth.end()) continue;
    const phi::Array2D<float> map = ReadTruthDepth(file->second, values_per_unit);
    for (CloudSample::Point& p : sample->points) {
      double depth = 0, true_depth = 0;
      if (p.error != 255 || std::find(p.views.begin(), p.views.end(), image) == p.views.end()) continue;
      if (!TruthAt(view, map, p, &depth, &true_depth)) continue;
      const double error = std::abs(depth - true_depth) / true_depth;
      p.error = static_cast<std::uint8_t>(std::min(254.0, error / CloudSample::kErrorUnit));
    }
  }
}

ReportCloud PackCloud(const CloudSample& sample) {
  ReportCloud cloud;
  if (sample.points.empty()) return cloud;
  FindCube(sample.points, &cloud);
  std::string positions, colors, normals, inferred, errors, view_counts, views;
  bool has_errors = false;
  for (const CloudSample::Point& p : sample.points) {
    if (!AppendPosition(p, cloud, &positions)) continue;
    colors.append(reinterpret_cast<const char*>(p.rgb.data()), 3);
    for (const float n : p.normal)
      AppendValue(static_cast<std::int8_t>(std::lround(127 * std::clamp(n, -1.0f, 1.0f))), &normals);
    AppendValue(static_cast<std::uint8_t>(p.inferred), &inferred);
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
  if (has_errors) cloud.errors = Base64(errors);
  if (!views.empty()) {
    cloud.view_counts = Base64(view_counts);
    cloud.views = Base64(views);
  }
  return cloud;
}

}  // namespace colmap_ext

#include "colmap_ext/evaluation/crop_volume.h"

#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

#include <Eigen/LU>

#include "colmap_ext/config_lines.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/json_file.h"
#include "colmap_ext/text_stream.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

// Of sixteen numbers, whatever stands between them.
constexpr std::size_t kMostText = 1 << 16;

Eigen::Vector2d Across(const Eigen::Vector3d& point, int axis) {
  return {point[axis == 0 ? 1 : 0], point[axis == 2 ? 1 : 2]};
}

}  // namespace

bool CropVolume::Contains(const Eigen::Vector3d& point) const {
  if (!(point[axis] >= min && point[axis] <= max)) return false;
  // A ray from the point along the first coordinate crosses the border of a polygon that holds it an odd number of times.
  const Eigen::Vector2d p = Across(point, axis);
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[j];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
  }
  return inside;
}

CropVolume ReadCropVolume(const std::filesystem::path& path) {
  std::ifstream stream = OpenNeededFile(path);
  const auto refuse = [&](const char* why) {
    throw phi::InputError(phi::AboutFile(path) + " is no crop volume (SelectionPolygonVolume): " + why);
  };
  CropVolume volume;
  try {
    const auto json = ParseJson(stream);
    const std::string axis = json.at("orthogonal_axis");
    constexpr std::string_view kAxes = "XYZxyz";
    const std::size_t at = axis.size() == 1 ? kAxes.find(axis) : std::string::npos;
    if (at == std::string::npos) throw phi::InputError("its orthogonal_axis must be X, Y or Z");  // told with the path
    volume.axis = static_cast<int>(at % 3);
    volume.min = json.at("axis_min");
    volume.max = json.at("axis_max");
    for (const auto& corner : json.at("bounding_polygon")) {
      volume.polygon.push_back(Across(
          {corner.at(0).get<double>(), corner.at(1).get<double>(), corner.at(2).get<double>()}, volume.axis));
    }
  } catch (const nlohmann::json::exception& error) {
    refuse(error.what());
  } catch (const phi::InputError& error) {
    refuse(error.what());
  }
  if (volume.polygon.size() < 3) throw phi::InputError(phi::AboutFile(path) + ": the polygon has no area");
  return volume;
}

Eigen::Matrix4d ReadSimilarity(const std::filesystem::path& path) {
  std::ifstream file = OpenNeededFile(path);
  std::string content(kMostText, '\0');
  file.read(content.data(), static_cast<std::streamsize>(content.size()));
  content.resize(static_cast<std::size_t>(file.gcount()));
  RequireUtf8(path, content);
  TextInput stream(content.starts_with(kByteOrderMark) ? content.substr(kByteOrderMark.size()) : content);
  Eigen::Matrix4d m;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) stream >> m(row, column);
  }
  const Eigen::Matrix3d a = m.topLeftCorner<3, 3>();
  const double scale = stream ? std::cbrt(a.determinant()) : 0;
  const bool is_similarity = scale > 0 && (a * a.transpose() / (scale * scale)).isIdentity(1e-3) &&
                             m.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1));
  if (!is_similarity) {
    throw phi::InputError(phi::AboutFile(path) +
                          ": these are not four rows of four numbers of a rotation, scale and translation");
  }
  return m;
}

}  // namespace colmap_ext

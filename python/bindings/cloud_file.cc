// A cloud's files, as phimvs/cloud.py has them written.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "colmap_ext/fusion/cloud_coordinates.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "python/bindings/module.h"
#include "python/bindings/numpy_arrays.h"
#include "python/bindings/text_caster.h"

namespace nb = nanobind;

namespace phimvs_python {
namespace {

using Bytes = Input<std::uint8_t>;
using Floats = Input<float>;
using Doubles = Input<double>;

// xyz, normals, colors, inferred, confidence.
using Points = std::tuple<Doubles, Floats, Bytes, Bytes, Bytes>;
// How many images see each point, and which, point by point.
using Views = std::pair<Input<std::uint32_t>, Input<std::uint32_t>>;
// The offset that positions count from, and whether they are doubles.
using Coordinates = std::pair<std::array<double, 3>, bool>;

// The .ply and .vis files that stereo_fusion writes.
void WriteCloud(const std::string& path, const Points& points, const Views& views, const Coordinates& coordinates) {
  const auto& [xyz, normals, colors, inferred, confidence] = points;
  const auto& [view_counts, views_of_points] = views;
  phi::FusedBlock block;
  block.points.resize(xyz.shape(0));
  for (std::size_t i = 0; i < block.points.size(); ++i) {
    phi::FusedPoint& point = block.points[i];
    std::copy_n(xyz.data() + 3 * i, 3, point.xyz);
    std::copy_n(normals.data() + 3 * i, 3, point.normal);
    std::copy_n(colors.data() + 3 * i, 3, point.rgb);
    point.inferred = inferred.data()[i] & 1;
    point.confidence = confidence.data()[i] & 0x7f;
  }
  block.view_counts.assign(view_counts.data(), view_counts.data() + view_counts.size());
  block.views.assign(views_of_points.data(), views_of_points.data() + views_of_points.size());
  const auto writer =
      colmap_ext::MakePlyCloudWriter({.path = path, .offset = coordinates.first, .in_doubles = coordinates.second});
  writer->Write(std::move(block));
  writer->Commit();
}

// stereo_fusion's rule for a cloud of which `points` are some.
Coordinates CoordinatesOf(double spacing, const std::array<double, 3>& middle, const Doubles& points) {
  const auto largest = [&](const Eigen::Vector3d& offset) {
    std::vector<double> coordinates(points.shape(0));
    for (std::size_t i = 0; i < coordinates.size(); ++i)
      coordinates[i] = (Eigen::Map<const Eigen::Vector3d>(points.data() + 3 * i) - offset).cwiseAbs().maxCoeff();
    return colmap_ext::LargestWithoutOutliers(std::move(coordinates));
  };
  const auto coordinates = colmap_ext::ChooseCoordinates(spacing, Eigen::Vector3d(middle.data()), largest);
  return {coordinates.offset, coordinates.in_doubles};
}

}  // namespace

void BindCloudFile(nb::module_& module) {
  module.def("write_cloud", &WriteCloud);
  module.def("cloud_coordinates", &CoordinatesOf);
}

}  // namespace phimvs_python

#include "colmap_ext/evaluation/truth_coverage.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/visibility_file.h"
#include "colmap_ext/workspace.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

// Which images see each point, as indices into the sparse model; of no point where nobody tells.
class PointImages {
 public:
  PointImages() = default;
  PointImages(const std::filesystem::path& path, std::size_t num_points) {
    if (!std::filesystem::exists(path)) {
      throw phi::InputError(phi::AboutFile(path) +
                            " is missing, which says what images see each point; stereo_fusion writes it beside its cloud. "
                            "Fuse again, or leave out --coverage_by_visibility");
    }
    VisibilityReader reader(path);
    if (reader.num_points() != num_points) {
      throw phi::InputError(phi::AboutFile(path) + " is of " + std::to_string(reader.num_points()) +
                            " points, the cloud has " + std::to_string(num_points) +
                            " that are finite; fuse again, or leave out --coverage_by_visibility");
    }
    begins_.reserve(num_points + 1);
    begins_.push_back(0);
    std::vector<std::uint32_t> images;
    for (std::size_t i = 0; i < num_points; ++i) {
      if (!reader.Next(&images)) throw phi::InputError(phi::AboutFile(path) + " is cut short; fuse again");
      images_.insert(images_.end(), images.begin(), images.end());
      begins_.push_back(images_.size());
    }
  }

  bool IsKnown() const { return !begins_.empty(); }
  bool Sees(std::uint32_t image, std::size_t point) const {
    const auto begin = images_.begin();
    const auto end = begin + static_cast<std::ptrdiff_t>(begins_[point + 1]);
    return std::find(begin + static_cast<std::ptrdiff_t>(begins_[point]), end, image) != end;
  }

 private:
  std::vector<std::size_t> begins_;
  std::vector<std::uint32_t> images_;
};

struct CloudPoints {
  const std::vector<phi::Vec3f>& points;
  Eigen::Vector3d origin;
  PointImages images;
  double hidden_by;
};

// Marks the points that fall on a pixel with truth in one image, number `image` of the sparse model.
void MarkCovered(const CloudPoints& cloud, const phi::Camera& camera, std::uint32_t image,
                 const phi::Array2D<float>& truth, std::vector<std::uint8_t>& covered) {
  const phi::Pinhole& k = camera.pinhole;
  // The truth may have been stored at another size than the camera's.
  const double scale_x = static_cast<double>(truth.width()) / k.width;
  const double scale_y = static_cast<double>(truth.height()) / k.height;
  const Eigen::Vector3d origin_in_camera = camera.pose * cloud.origin;
  tbb::parallel_for(std::size_t{0}, cloud.points.size(), [&](std::size_t i) {
    if (covered[i]) return;
    const phi::Vec3f& point = cloud.points[i];
    const Eigen::Vector3d p =
        camera.pose.rotation * Eigen::Vector3d(point.x, point.y, point.z) + origin_in_camera;
    if (!(p.z() > 0)) return;
    const double x = std::floor((p.x() / p.z() * k.fx + k.cx) * scale_x);
    const double y = std::floor((p.y() / p.z() * k.fy + k.cy) * scale_y);
    if (!(x >= 0 && y >= 0 && x < truth.width() && y < truth.height())) return;
    const float true_depth = truth(static_cast<int>(x), static_cast<int>(y));
    if (!(true_depth > 0)) return;
    const bool is_hidden = true_depth < p.z() - cloud.hidden_by;
    covered[i] = !cloud.images.IsKnown() || !is_hidden || cloud.images.Sees(image, i);
  });
}

}  // namespace

std::vector<bool> CoveredByTruth(const std::vector<phi::Vec3f>& points, const Eigen::Vector3d& origin,
                                 const CoverageOptions& options) {
  WorkspaceOptions workspace_options;
  workspace_options.path = options.workspace;
  const Workspace workspace(workspace_options);
  const auto maps = FindTruthMapsOf(workspace, options.truth_depth_maps);
  const CloudPoints cloud{
      points, origin,
      options.visibility.empty() ? PointImages() : PointImages(options.visibility, points.size()),
      options.hidden_by};
  std::vector<std::uint8_t> covered(points.size(), 0);
  for (std::size_t image = 0; image < workspace.views().size(); ++image) {
    phi::ThrowIfCancelled();
    const phi::SceneView& view = workspace.views()[image];
    const auto map = maps.find(view.name);
    if (map == maps.end()) continue;
    const phi::Array2D<float> truth = ReadTruthDepth(map->second, options.values_per_unit);
    RequireShapeOfImage(truth, map->second, view);
    MarkCovered(cloud, view.camera, static_cast<std::uint32_t>(image), truth, covered);
  }
  return {covered.begin(), covered.end()};
}

}  // namespace colmap_ext

#include "colmap_ext/pipeline/image_moves.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "colmap_ext/format_text.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// Of so few observations most may be mismatched.
constexpr int kFewestTelling = 10;

// The views most of whose observed points lie behind the camera, or beside the photo by more than its size.
std::vector<int> ViewsThatLookElsewhere(const phi::SparseScene& scene,
                                        const std::vector<phi::SceneView>& views) {
  std::vector<int> num_observed(views.size(), 0), num_in_sight(views.size(), 0);
  for (std::size_t point = 0; point < scene.num_points(); ++point) {
    for (const phi::PointObservation& seen : scene.track(point)) {
      ++num_observed[seen.view];
      const Eigen::Vector3d in_camera = views[seen.view].camera.pose * scene.point(point);
      if (!(in_camera.z() > 0)) continue;
      const phi::Pinhole& k = scene.model_pinhole(seen.view);
      const Eigen::Vector2d off = k.Project(in_camera) - Eigen::Vector2d(seen.u, seen.v);
      if (off.norm() < k.width + k.height) ++num_in_sight[seen.view];
    }
  }
  std::vector<int> elsewhere;
  for (int view = 0; view < static_cast<int>(views.size()); ++view) {
    if (num_observed[view] >= kFewestTelling && 2 * num_in_sight[view] < num_observed[view])
      elsewhere.push_back(view);
  }
  return elsewhere;
}

std::string WorkingSize(const Workspace& workspace) {
  int longest = 0;
  bool is_full = true;
  for (std::size_t i = 0; i < workspace.views().size(); ++i) {
    const phi::Pinhole& working = workspace.views()[i].camera.pinhole;
    longest = std::max({longest, working.width, working.height});
    const SparseCamera& camera = workspace.model().cameras.at(workspace.model().images[i].camera_id);
    is_full = is_full && static_cast<std::size_t>(working.width) == camera.width;
  }
  return is_full ? "full size" : FormatText("%d pixels", longest);
}

}  // namespace

std::string PoseWarning(const phi::ImageCorrections& corrections, const phi::SparseScene& scene,
                        const Workspace& workspace) {
  const std::vector<int> elsewhere = ViewsThatLookElsewhere(scene, workspace.views());
  if (!elsewhere.empty()) {
    return FormatText("%zu of %zu images", elsewhere.size(), workspace.views().size()) + ", " +
           workspace.views()[elsewhere.front()].name +
           " the first, have most of their sparse points behind the camera or far outside the photo, and "
           "depths "
           "will be wrong: poses must be world to camera, z forward, and of the model that the points are of";
  }
  const std::string off = "at " + WorkingSize(workspace) +
                          FormatText(" the photos show the sparse points %.1f pixels beside where their cameras see them",
                                     corrections.mean_offset);
  if (corrections.points_are_others)
    return off + ": are these the points of these cameras? Stereo takes the photos as they are";
  if (corrections.of_view.empty()) return "";
  std::vector<double> largest;  // by view; pixels of the working images, as the mean
  for (std::size_t i = 0; i < corrections.of_view.size(); ++i) {
    const phi::ImageCorrection& correction = corrections.of_view[i];
    largest.push_back(correction.LargestOffset() * workspace.views()[i].camera.pinhole.width / correction.model_width());
  }
  const auto worst = std::max_element(largest.begin(), largest.end());
  return off + ", neighbours alike: stereo moves the photos to them, " + workspace.views()[worst - largest.begin()].name +
         FormatText(" by up to %.1f pixels", *worst) +
         ". Likely causes, and what is better: poses that were not adjusted to the points (colmap bundle_adjuster before "
         "image_undistorter), a lens model too simple (one with more parameters), a rolling shutter (photos from where the camera "
         "stands still)";
}

void MoveImages(const phi::SparseScene& scene, const phi::StereoOptions& options, Workspace* workspace) {
  phi::ImageCorrections corrections =
      phi::FindImageCorrections(workspace->views(), scene, options.method);
  if (const std::string warning = PoseWarning(corrections, scene, *workspace); !warning.empty())
    phi::LogWarning(warning);
  workspace->SetCorrections(std::move(corrections.of_view));
}

}  // namespace colmap_ext

// What shared points say about pairs of views: the material of both rules that choose source views.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "phi/options.h"
#include "phi/scene_view.h"
#include "phi/sparse_scene.h"

namespace phi {

// Radian, [0, pi].
double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

// One point, seen by the reference view and by one source view.
struct ViewSample {
  int view = 0;             // the source
  std::uint32_t point = 0;  // which point: samples of one point follow each other
  float angle = 0;          // at the point, between the rays to both centres, radians
  float displacement = 0;   // Eq. 2's summand, pixels of the source view
  float log_scale = 0;      // log of pixels per surface length, source over reference
  Eigen::Vector3f to_source{0, 0, 0};  // unit, world axes, from the point to the source's centre
  float u = 0, v = 0;                  // of the point in the reference image, as shares of its width and height
};

// Measures points against pairs of views. Keeps references: all must outlive it.
class ViewSampler {
 public:
  ViewSampler(const std::vector<SceneView>& views, const std::vector<Eigen::Vector3d>& centers,
              const ViewSelectionOptions& options, int reference);

  // The scene's points `points`, in the source views whose tracks name them. A track may name a view twice: it counts once.
  std::vector<ViewSample> FromPoints(const SparseScene& scene, std::span<const std::uint32_t> points) const;

  // Where no points tell: a grid of pixels at several depths stands for the unknown surface, and the cameras nearest to the
  // reference are the candidates. World units.
  std::vector<ViewSample> FromFrustum(double depth_min, double depth_max) const;

 private:
  bool Measure(int source, const Eigen::Vector3d& world, bool inside, ViewSample* sample) const;
  std::vector<Eigen::Vector3d> FrustumPoints(double depth_min, double depth_max) const;
  std::vector<int> NearbyCameras() const;

  const std::vector<SceneView>& views_;
  const std::vector<Eigen::Vector3d>& centers_;
  const ViewSelectionOptions& options_;
  double scale_;  // of the rule's constants
  int reference_;
};

}  // namespace phi

// The sparse reconstruction as the dense stages need it: points, and which view sees which point where.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "phi/geometry/camera.h"

namespace phi {

struct PointObservation {
  int view = 0;        // index into the scene's views
  float u = 0, v = 0;  // pixels of the sparse model's image, K's coordinates
};

// Points with their tracks, in flat arrays: a scene of 10,000 views has tens of millions of observations.
class SparseScene {
 public:
  // model_pinholes: the sparse model's intrinsics of each view, before any reduction to the working
  // resolution.
  explicit SparseScene(std::vector<Pinhole> model_pinholes) : model_pinholes_(std::move(model_pinholes)) {}

  void AddPoint(const Eigen::Vector3d& world, std::span<const PointObservation> track) {
    points_.push_back(world);
    observations_.insert(observations_.end(), track.begin(), track.end());
    first_observation_.push_back(observations_.size());
  }

  int num_views() const { return static_cast<int>(model_pinholes_.size()); }
  std::size_t num_points() const { return points_.size(); }
  std::size_t num_observations() const { return observations_.size(); }
  const Pinhole& model_pinhole(int view) const { return model_pinholes_[view]; }
  const Eigen::Vector3d& point(std::size_t index) const { return points_[index]; }
  std::span<const PointObservation> track(std::size_t index) const {
    return {observations_.data() + first_observation_[index],
            first_observation_[index + 1] - first_observation_[index]};
  }

 private:
  std::vector<Pinhole> model_pinholes_;
  std::vector<Eigen::Vector3d> points_;  // world
  std::vector<std::size_t> first_observation_{0};
  std::vector<PointObservation> observations_;
};

// For each view, the points that it sees, each once, in the scene's order.
class VisiblePoints {
 public:
  explicit VisiblePoints(const SparseScene& scene);
  std::span<const std::uint32_t> operator[](int view) const {
    return {points_.data() + first_[view], first_[view + 1] - first_[view]};
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<std::uint32_t> points_;
};

}  // namespace phi

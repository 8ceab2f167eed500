#include "phi/inference/scene_directions.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "phi/base/cauchy_weight.h"
#include "phi/inference/camera_plane.h"

namespace phi {
namespace {

constexpr double kMaxDegrees = 2;  // between a plane's normal and the direction that it stands along
constexpr double kMinShareAlong = 0.5;  // of the cells, on planes along the directions
constexpr int kMaxTurns = 6, kDistanceRounds = 4;
constexpr double kSmallTurn = 1e-9;  // radian

// A direction in each column.
using Directions = Eigen::Matrix3d;

// Of the direction that the normal stands along; -1: of none.
int ColumnAlong(const Directions& directions, const Eigen::Vector3d& normal) {
  Eigen::Index column = 0;
  const double cosine = (directions.transpose() * normal).cwiseAbs().maxCoeff(&column);
  return cosine > std::cos(kMaxDegrees * std::numbers::pi / 180) ? static_cast<int>(column) : -1;
}

// Of the plane with that normal through the cells. A residual of one tolerance counts half.
double InverseDistance(const std::vector<AnchorCell>& cells, const Eigen::Vector3d& normal, const Pinhole& pinhole) {
  double k = 0;
  for (int round = 0; round < kDistanceRounds; ++round) {
    double ws = 0, ss = 0;
    for (const AnchorCell& cell : cells) {
      const double s = normal.dot(RayOf(cell.x, cell.y, pinhole)) / cell.tolerance, w = cell.w / cell.tolerance;
      const double weight = round == 0 ? 1 : CauchyWeight(w - k * s);
      ws += weight * w * s;
      ss += weight * s * s;
    }
    k = ws / ss;
  }
  return k;
}

// Least squares for a small turn of all directions; each plane's distance is free.
class TurnEquations {
 public:
  // At inverse distance k, a cell's inverse depth is k * normal . ray, to which a turn adds k * turn . (normal x ray).
  void Add(const std::vector<AnchorCell>& cells, const Eigen::Vector3d& normal, const Pinhole& pinhole) {
    const double k = InverseDistance(cells, normal, pinhole);
    Eigen::Matrix3d by_turn = Eigen::Matrix3d::Zero();
    Eigen::Vector3d mixed = Eigen::Vector3d::Zero(), turn_side = Eigen::Vector3d::Zero();
    double by_distance = 0, distance_side = 0;
    for (const AnchorCell& cell : cells) {
      const Eigen::Vector3d ray = RayOf(cell.x, cell.y, pinhole);
      const Eigen::Vector3d turned = k / cell.tolerance * normal.cross(ray);
      const double moved = normal.dot(ray) / cell.tolerance, residual = cell.w / cell.tolerance - k * moved;
      const double weight = CauchyWeight(residual);
      by_turn += weight * turned * turned.transpose();
      mixed += weight * moved * turned;
      by_distance += weight * moved * moved;
      turn_side += weight * residual * turned;
      distance_side += weight * residual * moved;
    }
    matrix_ += by_turn - mixed * mixed.transpose() / by_distance;
    side_ += turn_side - mixed * (distance_side / by_distance);
  }

  Eigen::Vector3d Solve() const { return matrix_.ldlt().solve(side_); }

 private:
  Eigen::Matrix3d matrix_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d side_ = Eigen::Vector3d::Zero();
};

class DirectionSearch {
 public:
  DirectionSearch(std::span<const CarriedPlane> planes, const Pinhole& pinhole) : planes_(planes), pinhole_(pinhole) {
    for (const CarriedPlane& plane : planes) {
      normals_.push_back(NormalOf(plane, pinhole).normalized());
      num_cells_ += plane.cells.size();
    }
  }

  // Two planes at right angles give three directions: those that most cells' planes stand along. False: fewer than half.
  bool FindFirst(Directions* best) const {
    std::size_t most = 0;
    for (const Eigen::Vector3d& first : normals_) {
      for (const Eigen::Vector3d& second : normals_) {
        if (std::abs(first.dot(second)) > std::sin(kMaxDegrees * std::numbers::pi / 180)) continue;
        Directions directions;
        directions.col(0) = first;
        directions.col(1) = (second - second.dot(first) * first).normalized();
        directions.col(2) = directions.col(0).cross(directions.col(1));
        const std::size_t count = CountAlong(directions);
        if (count <= most) continue;
        most = count;
        *best = directions;
      }
    }
    return most > 0 && static_cast<double>(most) >= kMinShareAlong * static_cast<double>(num_cells_);
  }

  // To the cells of all planes along them.
  void Refine(Directions* directions) const {
    for (int i = 0; i < kMaxTurns; ++i) {
      TurnEquations equations;
      for (std::size_t p = 0; p < planes_.size(); ++p) {
        const int column = ColumnAlong(*directions, normals_[p]);
        if (column >= 0) equations.Add(planes_[p].cells, directions->col(column), pinhole_);
      }
      const Eigen::Vector3d turn = equations.Solve();
      const double angle = turn.norm();
      if (!(angle > kSmallTurn && angle < 1)) return;
      *directions = Eigen::AngleAxisd(angle, turn / angle) * *directions;
    }
  }

 private:
  std::size_t CountAlong(const Directions& directions) const {
    std::size_t count = 0;
    for (std::size_t p = 0; p < planes_.size(); ++p) {
      if (ColumnAlong(directions, normals_[p]) >= 0) count += planes_[p].cells.size();
    }
    return count;
  }

  std::span<const CarriedPlane> planes_;
  Pinhole pinhole_;
  std::vector<Eigen::Vector3d> normals_;  // of the planes
  std::size_t num_cells_ = 0;
};

}  // namespace

ImagePlane SceneDirections::PlaneAlong(int direction) const { return PlaneOf(directions_.col(direction), pinhole_); }

double SceneDirections::AngleTo(const ImagePlane& plane) const {
  const double cosine = (directions_.transpose() * NormalOf(plane, pinhole_).normalized()).cwiseAbs().maxCoeff();
  return std::acos(std::min(1.0, cosine));
}

std::optional<SceneDirections> FindDirections(std::span<const CarriedPlane> planes, const Pinhole& pinhole) {
  const DirectionSearch search(planes, pinhole);
  Directions directions;
  if (!search.FindFirst(&directions)) return std::nullopt;
  search.Refine(&directions);
  return SceneDirections(directions, pinhole);
}

}  // namespace phi

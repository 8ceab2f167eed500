#include "phi/inference/aligned_planes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace phi {
namespace {

constexpr std::size_t kMaxPlanesAlong = 4;
constexpr double kMinWeightAlong = 3;  // of the cells on a plane
constexpr double kMinSlant = 1e-3;  // of a cell's ray to the plane: the direction's inverse depth there
constexpr double kRounding = 1;  // a cell's weight: far more than sums of them are rounded by
constexpr double kMaxRelative = 0.5;  // of a cell's tolerance: a vaguer one is on any plane

// What some cells say of a plane by its inverse distance x: the sum of weight * (1 - ((x - inverse) / tolerance)^2).
struct Parabola {
  double weight = 0, square = 0, linear = 0, constant = 0;

  void Add(const Parabola& other, double sign) {
    weight += sign * other.weight;
    square += sign * other.square;
    linear += sign * other.linear;
    constant += sign * other.constant;
  }
  double Top() const { return linear / square; }
  double AtTop() const { return weight - constant + linear * linear / square; }
};

// The inverse distance of the plane through a cell.
struct Distance {
  double inverse, tolerance;
  Parabola says;

  Distance(double inverse, double tolerance, double weight) : inverse(inverse), tolerance(tolerance) {
    const double each = weight / (tolerance * tolerance);
    says = {weight, each, each * inverse, each * inverse * inverse};
  }
  bool Reaches(double at) const { return std::abs(at - inverse) < tolerance; }
};

class DistanceSearch {
 public:
  DistanceSearch(const ImagePlane& direction, std::span<const AnchorCell> cells) {
    for (const AnchorCell& cell : cells) {
      const double slant = direction.InverseDepth(cell.x, cell.y);
      if (std::abs(slant) < kMinSlant || !(cell.tolerance < kMaxRelative * cell.w)) continue;
      const Distance distance(cell.w / slant, cell.tolerance / std::abs(slant), cell.weight);
      ends_.push_back({distance.inverse - distance.tolerance, 1, distances_.size()});
      ends_.push_back({distance.inverse + distance.tolerance, -1, distances_.size()});
      distances_.push_back(distance);
    }
    std::sort(ends_.begin(), ends_.end(),
              [](const End& a, const End& b) { return std::pair(a.at, a.distance) < std::pair(b.at, b.distance); });
  }

  // Where the cells that reach there say most, and takes them away; false: too few cells are left on any. Between two ends the
  // sum is one parabola, and where a cell begins or ends it bends upward: it is greatest at the top of a parabola.
  bool Next(double* inverse) {
    double most = kMinWeightAlong;
    bool found = false;
    Parabola sum;
    for (std::size_t i = 0; i + 1 < ends_.size(); ++i) {
      sum.Add(distances_[ends_[i].distance].says, ends_[i].sign);
      if (sum.weight + kRounding < most) continue;  // nowhere is the sum above it
      const double top = sum.Top();
      if (!(top >= ends_[i].at && top <= ends_[i + 1].at && sum.AtTop() > most)) continue;
      most = sum.AtTop();
      *inverse = top;
      found = true;
    }
    if (!found) return false;
    for (Distance& d : distances_) {
      if (d.Reaches(*inverse)) d.says = {};
    }
    return true;
  }

 private:
  // Of the range of inverse distances that a cell reaches.
  struct End {
    double at, sign;
    std::size_t distance;  // index
  };

  std::vector<Distance> distances_;  // weight 0: taken
  std::vector<End> ends_;            // ascending
};

}  // namespace

std::vector<ImagePlane> PlanesAlong(const ImagePlane& direction, std::span<const AnchorCell> cells) {
  DistanceSearch search(direction, cells);
  std::vector<ImagePlane> planes;
  for (double inverse = 0; planes.size() < kMaxPlanesAlong && search.Next(&inverse);)
    planes.push_back({direction.a * inverse, direction.b * inverse, direction.c * inverse});
  return planes;
}

}  // namespace phi

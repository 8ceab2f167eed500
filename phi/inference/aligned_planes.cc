#include "phi/inference/aligned_planes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace phi {
namespace {

constexpr std::size_t kMaxPlanesAlong = 4;
constexpr double kMinWeightAlong = 3;  // of the cells on a plane
constexpr double kMinSlant = 1e-3;  // of a cell's ray to the plane: the direction's inverse depth there
constexpr double kMaxRelative = 0.5;  // of a cell's tolerance: a vaguer one is on any plane

// The inverse distance of the plane through a cell.
struct Distance {
  double inverse, tolerance, weight;
};

double Square(double v) { return v * v; }

class DistanceSearch {
 public:
  DistanceSearch(const ImagePlane& direction, std::span<const AnchorCell> cells) {
    for (const AnchorCell& cell : cells) {
      const double slant = direction.InverseDepth(cell.x, cell.y);
      if (std::abs(slant) < kMinSlant || !(cell.tolerance < kMaxRelative * cell.w)) continue;
      distances_.push_back({cell.w / slant, cell.tolerance / std::abs(slant), cell.weight});
      reach_ = std::max(reach_, cell.tolerance / cell.w);
    }
    std::sort(distances_.begin(), distances_.end(), [](const Distance& a, const Distance& b) { return a.inverse < b.inverse; });
  }

  // False: too few cells are left on any.
  bool Next(double* inverse) {
    double most = 0;
    for (const Distance& distance : distances_) {
      if (distance.weight == 0) continue;
      double sum = 0;
      ForAllAt(distance.inverse, [&](const Distance& d) {
        sum += d.weight * (1 - Square((d.inverse - distance.inverse) / d.tolerance));
      });
      if (sum <= most) continue;
      most = sum;
      *inverse = distance.inverse;
    }
    if (most < kMinWeightAlong) return false;
    *inverse = MeanAt(*inverse);
    ForAllAt(*inverse, [](Distance& d) { d.weight = 0; });
    return true;
  }

 private:
  // Those with `inverse` within their tolerance.
  template <typename Function>
  void ForAllAt(double inverse, const Function& function) {
    const auto before = [](const Distance& d, double value) { return d.inverse < value; };
    const auto [low, high] = std::minmax({inverse / (1 - reach_), inverse / (1 + reach_)});
    auto d = std::lower_bound(distances_.begin(), distances_.end(), low, before);
    for (; d != distances_.end() && d->inverse <= high; ++d) {
      if (std::abs(d->inverse - inverse) < d->tolerance) function(*d);
    }
  }

  double MeanAt(double inverse) {
    double sum = 0, weights = 0;
    ForAllAt(inverse, [&](const Distance& d) {
      const double weight = d.weight / Square(d.tolerance);
      sum += weight * d.inverse;
      weights += weight;
    });
    return sum / weights;
  }

  std::vector<Distance> distances_;  // ascending; weight 0: taken
  double reach_ = 0;  // the greatest tolerance, relative
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

// Free space as a laser scanner saw it: the beam from the scanner to each scan point, a slightly widening
// cone, was empty up to the point. A reconstructed point inside a beam in front of its scan point is wrong; a
// point in no beam is unobserved and must not count (ETH3D's protocol).
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "colmap_ext/evaluation/tolerance_class.h"
#include "phi/base/vec.h"

namespace colmap_ext {

struct BeamOptions {
  double start_radius = 0.5 * 0.00225;   // world units, at the scanner
  double divergence_half_angle = 0.011;  // degrees
};

class ScanBeams {
 public:
  // `points` and `scanner`: world frame, the points relative to the same origin as all evaluated clouds.
  ScanBeams(const std::vector<phi::Vec3f>& points, const phi::Vec3f& scanner, const BeamOptions& options);

  // The class of `point` by this scan alone. Right at a tolerance: within it of a scan point whose beam
  // covers `point`.
  ToleranceClass Classify(const phi::Vec3f& point, const std::vector<double>& tolerances) const;

 private:
  int Row(double inclination) const;
  int Column(double azimuth) const;

  phi::Vec3f scanner_;
  double start_radius_, tan_half_angle_;
  // Scan points relative to the scanner, ordered by cell of (inclination, azimuth); cell c holds
  // [cell_begin_[c], cell_begin_[c + 1]).
  std::vector<phi::Vec3f> points_;
  std::vector<std::uint32_t> cell_begin_;
};

// Over all scans: right where some scan says right, else wrong where some scan says wrong, else unobserved.
std::vector<ToleranceClass> ClassifyByBeams(const std::vector<phi::Vec3f>& points,
                                            const std::vector<ScanBeams>& scans,
                                            const std::vector<double>& tolerances);

}  // namespace colmap_ext

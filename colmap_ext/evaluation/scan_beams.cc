#include "colmap_ext/evaluation/scan_beams.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "phi/base/cancellation.h"

namespace colmap_ext {
namespace {

using phi::Vec3f;

constexpr double kPi = std::numbers::pi;
// Cells of about 0.18 degrees: near a beam's width at one metre, so few points outside the beam are looked
// at.
constexpr int kRows = 1024;     // inclination, [0, pi] from +z
constexpr int kColumns = 2048;  // azimuth, [-pi, pi)

double Azimuth(const Vec3f& v) { return std::atan2(v.y, v.x); }
double Inclination(const Vec3f& v, double range) { return std::acos(std::clamp(v.z / range, -1.0, 1.0)); }

}  // namespace

int ScanBeams::Row(double inclination) const {
  return std::clamp(static_cast<int>(std::floor(inclination / kPi * kRows)), 0, kRows - 1);
}

// May be outside [0, kColumns): the caller wraps.
int ScanBeams::Column(double azimuth) const {
  return static_cast<int>(std::floor((azimuth + kPi) / (2 * kPi) * kColumns));
}

ScanBeams::ScanBeams(const std::vector<Vec3f>& points, const Vec3f& scanner, const BeamOptions& options)
    : scanner_(scanner),
      start_radius_(options.start_radius),
      tan_half_angle_(std::tan(options.divergence_half_angle * kPi / 180)) {
  std::vector<std::uint32_t> cells(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    const Vec3f v = points[i] - scanner_;
    const int row = Row(Inclination(v, phi::Norm(v)));
    cells[i] = static_cast<std::uint32_t>(row * kColumns + (Column(Azimuth(v)) + kColumns) % kColumns);
  });
  cell_begin_.assign(static_cast<std::size_t>(kRows) * kColumns + 1, 0);
  for (std::uint32_t cell : cells) ++cell_begin_[cell + 1];
  for (std::size_t c = 1; c < cell_begin_.size(); ++c) cell_begin_[c] += cell_begin_[c - 1];
  std::vector<std::uint32_t> next(cell_begin_.begin(), cell_begin_.end() - 1);
  points_.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) points_[next[cells[i]]++] = points[i] - scanner_;
}

ToleranceClass ScanBeams::Classify(const Vec3f& point, const std::vector<double>& tolerances) const {
  const Vec3f p = point - scanner_;
  const double range = phi::Norm(p);
  const double beam_radius = start_radius_ + range * tan_half_angle_;
  // The directions whose rays pass within beam_radius of p: a cap of angular radius `cap` about p's
  // direction.
  const bool everywhere = beam_radius >= range;
  const double cap = everywhere ? kPi : std::asin(beam_radius / range);
  const double inclination = everywhere ? 0 : Inclination(p, range);
  const double half_width = everywhere || std::sin(inclination) <= std::sin(cap)
                                ? kPi
                                : std::asin(std::sin(cap) / std::sin(inclination));
  const int first_column = half_width >= kPi ? 0 : Column(Azimuth(p) - half_width);
  const int last_column = half_width >= kPi ? kColumns - 1 : Column(Azimuth(p) + half_width);

  std::size_t first_right = tolerances.size();
  bool contradicted = false;
  for (int row = Row(inclination - cap); row <= Row(inclination + cap); ++row) {
    for (int column = first_column; column <= last_column; ++column) {
      const int cell = row * kColumns + (column + kColumns) % kColumns;
      for (std::uint32_t i = cell_begin_[cell]; i < cell_begin_[cell + 1]; ++i) {
        const Vec3f& scan = points_[i];
        const float scan_range = phi::Norm(scan);
        const float along = phi::Dot(scan, p) / scan_range;
        if (!(along >= 0)) continue;
        if (phi::Norm(p - (along / scan_range) * scan) > beam_radius) continue;
        const double distance = phi::Norm(p - scan);
        while (first_right > 0 && distance <= tolerances[first_right - 1]) --first_right;
        contradicted |= along < scan_range;
      }
    }
  }
  const auto verdict = static_cast<ToleranceClass>(first_right);
  return contradicted ? verdict : verdict | kUnobservedBelow;
}

std::vector<ToleranceClass> ClassifyByBeams(const std::vector<Vec3f>& points,
                                            const std::vector<ScanBeams>& scans,
                                            const std::vector<double>& tolerances) {
  std::vector<ToleranceClass> classes(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    if (i % 65536 == 0) phi::ThrowIfCancelled();
    int first_right = static_cast<int>(tolerances.size());
    bool contradicted = false;
    for (const ScanBeams& scan : scans) {
      const ToleranceClass by_scan = scan.Classify(points[i], tolerances);
      first_right = std::min(first_right, FirstRightTolerance(by_scan));
      contradicted |= !(by_scan & kUnobservedBelow);
    }
    const auto verdict = static_cast<ToleranceClass>(first_right);
    classes[i] = contradicted ? verdict : verdict | kUnobservedBelow;
  });
  return classes;
}

}  // namespace colmap_ext

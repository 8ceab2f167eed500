#include "phi/view_coverage.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace phi {
namespace {

constexpr float kRadians = std::numbers::pi_v<float> / 180;

// Depth is told poorly at angles well below the first, matching suffers at angles near the second.
constexpr float kTellingAngle = 5 * kRadians, kMatchingAngle = 30 * kRadians;
// Directions to two sources that differ by less than this are hardly two witnesses: they share occlusions and errors.
constexpr float kIndependentAngle = 3 * kRadians;
// The image's cells, in each direction.
constexpr int kColumns = 12, kRows = 8;
// A cell with so few points counts half: they may be mismatched ones.
constexpr float kFewPoints = 3;
// What a view must add, of what the first one shows: less is not worth its time.
constexpr double kLeastGain = 0.005;
// Gains are summed as integers, so that the points' order does not matter.
constexpr double kUnitsPerGain = 4294967296.0;

float Square(float x) { return x * x; }

// Share of a view's evidence that another one from a direction `angle` radians apart does not repeat.
float Independence(float angle, float scale) {
  return 1 - std::exp(-Square(angle / (scale * kIndependentAngle)));
}

float Worth(const ViewSample& sample, float scale) {
  // A source that sees the surface at another scale compares blurred with sharp.
  return UsefulAngle(sample.angle, scale) * std::exp(-std::abs(sample.log_scale));
}

// How well a point is shown by evidence worth so many good views: half by one, two thirds by two, and ever less is gained.
double Shown(float evidence) { return evidence / (1.0 + evidence); }

int Cell(const ViewSample& sample) {
  const int column = std::clamp(static_cast<int>(sample.u * kColumns), 0, kColumns - 1);
  const int row = std::clamp(static_cast<int>(sample.v * kRows), 0, kRows - 1);
  return row * kColumns + column;
}

}  // namespace

float UsefulAngle(float angle, float scale) {
  return (1 - std::exp(-Square(angle / (scale * kTellingAngle)))) *
         std::exp(-Square(angle / (scale * kMatchingAngle)));
}

ViewCoverage::ViewCoverage(std::span<const ViewSample> samples, const std::vector<std::uint32_t>& image_ids,
                           float scale)
    : scale_(scale) {
  FindViews(samples, image_ids);
  gains_.assign(views_.size(), 0);
  points_of_.resize(views_.size());
  witnesses_.reserve(samples.size());
  std::vector<int> cells, num_points(kColumns * kRows, 0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ViewSample& sample = samples[i];
    if (i == 0 || sample.point != samples[i - 1].point) {
      points_.push_back({.begin = i, .end = i});
      cells.push_back(Cell(sample));
      ++num_points[cells.back()];
    }
    ++points_.back().end;
    const int candidate = candidate_of_view_[sample.view];
    witnesses_.push_back({.candidate = candidate, .worth = Worth(sample, scale), .to_source = sample.to_source});
    points_of_[candidate].push_back(points_.size() - 1);
  }
  for (std::size_t p = 0; p < points_.size(); ++p) {
    points_[p].weight = 1 / (static_cast<float>(num_points[cells[p]]) + scale * kFewPoints);
    SetGains(points_[p]);
  }
}

void ViewCoverage::FindViews(std::span<const ViewSample> samples, const std::vector<std::uint32_t>& image_ids) {
  candidate_of_view_.assign(image_ids.size(), -1);
  for (const ViewSample& sample : samples) {
    if (candidate_of_view_[sample.view] < 0) views_.push_back(sample.view);
    candidate_of_view_[sample.view] = 0;
  }
  std::sort(views_.begin(), views_.end(), [&](int a, int b) { return image_ids[a] < image_ids[b]; });
  for (std::size_t c = 0; c < views_.size(); ++c) candidate_of_view_[views_[c]] = static_cast<int>(c);
}

// What each witness of a point gains there, in place of what it gained before.
void ViewCoverage::SetGains(const Point& point) {
  const double shown = Shown(point.shown);
  for (std::size_t i = point.begin; i < point.end; ++i) {
    Witness& witness = witnesses_[i];
    const double gain = point.weight * (Shown(point.shown + witness.worth * witness.novelty) - shown);
    gains_[witness.candidate] -= witness.gain;
    witness.gain = std::llround(gain * kUnitsPerGain);
    gains_[witness.candidate] += witness.gain;
  }
}

void ViewCoverage::Add(int candidate) {
  for (const std::size_t p : points_of_[candidate]) {
    Point& point = points_[p];
    const auto begin = witnesses_.begin() + static_cast<std::ptrdiff_t>(point.begin);
    Add(&point, *std::find_if(begin, witnesses_.end(), [candidate](const Witness& w) { return w.candidate == candidate; }));
  }
}

void ViewCoverage::Add(Point* point, const Witness& taken) {
  point->shown += taken.worth * taken.novelty;
  const Eigen::Vector3f direction = taken.to_source;
  for (std::size_t i = point->begin; i < point->end; ++i) {
    Witness& witness = witnesses_[i];
    // The chord, for the small angles that matter.
    // In this order, as Eigen has it on x86-64: with NEON it has another.
    const Eigen::Vector3f apart = witness.to_source - direction;
    const float squared_apart = apart.x() * apart.x() + (apart.y() * apart.y() + apart.z() * apart.z());
    if (!(squared_apart < witness.squared_apart)) continue;
    witness.squared_apart = squared_apart;
    witness.novelty = Independence(std::sqrt(squared_apart), scale_);
  }
  SetGains(*point);
}

std::vector<int> ViewCoverage::Take(const std::vector<int>& candidates, std::size_t max_size) {
  std::vector<char> is_open(views_.size(), 0);
  for (const int view : candidates) {
    if (candidate_of_view_[view] >= 0) is_open[candidate_of_view_[view]] = 1;
  }
  std::vector<int> taken;
  std::int64_t first_gain = 0;
  while (taken.size() < max_size) {
    int best = -1;
    for (std::size_t c = 0; c < gains_.size(); ++c) {
      if (is_open[c] && (best < 0 || gains_[c] > gains_[best])) best = static_cast<int>(c);
    }
    if (best < 0 || gains_[best] <= 0) break;
    if (taken.empty()) first_gain = gains_[best];
    if (static_cast<double>(gains_[best]) < scale_ * kLeastGain * static_cast<double>(first_gain)) break;
    is_open[best] = 0;
    taken.push_back(views_[best]);
    Add(best);
  }
  return taken;
}

}  // namespace phi

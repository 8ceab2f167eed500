#include "phi/view_coverage.h"

#include <algorithm>
#include <cmath>
#include <map>
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
  std::map<std::uint32_t, int> view_of_id;
  for (const ViewSample& sample : samples) view_of_id.emplace(image_ids[sample.view], sample.view);
  std::map<int, int> candidate_of_view;
  for (const auto& [id, view] : view_of_id) {
    candidate_of_view.emplace(view, static_cast<int>(views_.size()));
    views_.push_back(view);
  }
  std::vector<int> cells, num_points(kColumns * kRows, 0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ViewSample& sample = samples[i];
    if (i == 0 || sample.point != samples[i - 1].point) {
      points_.push_back({.begin = i, .end = i});
      cells.push_back(Cell(sample));
      ++num_points[cells.back()];
    }
    ++points_.back().end;
    witnesses_.push_back({candidate_of_view[sample.view], Worth(sample, scale), 1, sample.to_source});
  }
  for (std::size_t p = 0; p < points_.size(); ++p) {
    points_[p].weight = 1 / (static_cast<float>(num_points[cells[p]]) + scale * kFewPoints);
  }
}

// Of each of views_, were it taken next.
std::vector<std::int64_t> ViewCoverage::Gains() const {
  std::vector<std::int64_t> gains(views_.size(), 0);
  for (const Point& point : points_) {
    const double shown = Shown(point.shown);
    for (std::size_t i = point.begin; i < point.end; ++i) {
      const Witness& witness = witnesses_[i];
      const double gain = point.weight * (Shown(point.shown + witness.worth * witness.novelty) - shown);
      gains[witness.candidate] += std::llround(gain * kUnitsPerGain);
    }
  }
  return gains;
}

void ViewCoverage::Add(int candidate) {
  for (Point& point : points_) {
    const auto begin = witnesses_.begin() + static_cast<std::ptrdiff_t>(point.begin);
    const auto end = witnesses_.begin() + static_cast<std::ptrdiff_t>(point.end);
    const auto taken =
        std::find_if(begin, end, [candidate](const Witness& w) { return w.candidate == candidate; });
    if (taken == end) continue;
    point.shown += taken->worth * taken->novelty;
    for (auto other = begin; other != end; ++other) {
      // The chord, for the small angles that matter.
      const float apart = (other->to_source - taken->to_source).norm();
      other->novelty = std::min(other->novelty, Independence(apart, scale_));
    }
  }
}

std::vector<int> ViewCoverage::Take(const std::vector<int>& candidates, std::size_t max_size) {
  std::vector<char> is_open(views_.size(), 0);
  for (std::size_t c = 0; c < views_.size(); ++c) {
    is_open[c] = std::find(candidates.begin(), candidates.end(), views_[c]) != candidates.end();
  }
  std::vector<int> taken;
  std::int64_t first_gain = 0;
  while (taken.size() < max_size) {
    const std::vector<std::int64_t> gains = Gains();
    int best = -1;
    for (std::size_t c = 0; c < gains.size(); ++c) {
      if (is_open[c] && (best < 0 || gains[c] > gains[best])) best = static_cast<int>(c);
    }
    if (best < 0 || gains[best] <= 0) break;
    if (taken.empty()) first_gain = gains[best];
    if (static_cast<double>(gains[best]) < scale_ * kLeastGain * static_cast<double>(first_gain)) break;
    is_open[best] = 0;
    taken.push_back(views_[best]);
    Add(best);
  }
  return taken;
}

}  // namespace phi

#include "phi/inference/scene_planes.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/base/random.h"
#include "phi/inference/scored_anchors.h"
#include "phi/inference/source_anchors.h"

namespace phi {
namespace {

constexpr int kMaxPlanes = 25;
constexpr int kMinCells = 25;        // on a plane
constexpr int kMinCellPoints = 8;    // of a large image one view has six in a full cell: two views at least saw it
constexpr int kDraws = 300;          // for a plane
constexpr std::size_t kMaxScored = 3000;  // cells that a draw is scored on
constexpr int kAttempts = 24;        // to find a draw's two other cells
// The three cells of a draw lie within 2 to 32 cells of each other, so that small surfaces are drawn as well as large ones.
constexpr float kMinReach = 1, kMaxReach = 5;  // logarithms to base 2
constexpr int kMinStep = 2;  // neighbouring pixels tell nothing new
constexpr std::int64_t kMaxPointsPerView = std::int64_t{1} << 16;
constexpr float kBeside = 0.5f;  // of the image's sides

int StepOf(int width, int height) { return SamplingStep(width, height, kMinStep, kMaxPointsPerView); }

std::vector<AnchorPoint> OwnPoints(const MeasurementMap& map) {
  std::vector<AnchorPoint> points;
  const int step = StepOf(map.width(), map.height());
  for (int y = 0; y < map.height(); y += step) {
    for (int x = 0; x < map.width(); x += step) {
      if (CarriesPlanes(map.states(x, y)))
        points.push_back({static_cast<float>(x), static_cast<float>(y), 1 / map.planes(x, y).depth});
    }
  }
  return points;
}

std::vector<AnchorPoint> SourcePoints(const InferenceInput& input, const ViewImage& source, const MeasuredDepths& depths) {
  std::vector<AnchorPoint> points;
  const auto width = static_cast<float>(input.measured->width()), height = static_cast<float>(input.measured->height());
  const SourceAnchors anchors(source, depths, input.reference.view->camera);
  const int step = StepOf(depths.width(), depths.height());
  SourceAnchorRow row;
  for (int y = 0; y < depths.height(); y += step) {
    anchors.FindRow(y, step, &row);
    for (std::size_t i = 0; i < row.u.size(); ++i) {
      const float u = row.u[i], v = row.v[i], w = row.inverse_depth[i];
      if (!(w > 0)) continue;
      if (!(u > -kBeside * width && u < (1 + kBeside) * width && v > -kBeside * height && v < (1 + kBeside) * height)) continue;
      points.push_back({u - 0.5f, v - 0.5f, w});
    }
  }
  return points;
}

std::vector<AnchorPoint> MeasuredPoints(const InferenceInput& input) {
  std::vector<std::vector<AnchorPoint>> parts(1 + std::min(input.sources.size(), input.source_depths.size()));
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    if (i == 0) {
      parts[i] = OwnPoints(*input.measured);
    } else if (input.source_depths[i - 1] != nullptr) {
      parts[i] = SourcePoints(input, input.sources[i - 1], *input.source_depths[i - 1]);
    }
  });
  std::size_t num_points = 0;
  for (const auto& part : parts) num_points += part.size();
  std::vector<AnchorPoint> points;
  points.reserve(num_points);
  for (const auto& part : parts) points.insert(points.end(), part.begin(), part.end());
  return points;
}

std::size_t IndexOf(std::uint32_t word, std::size_t size) { return static_cast<std::uint64_t>(word) * size >> 32; }

class PlaneSearch {
 public:
  PlaneSearch(std::vector<AnchorCell> cells, float side, RandomKey key) : cells_(std::move(cells)), side_(side), key_(key) {}

  // The plane that most of the cells lie on, which are taken away; false: too few lie on one.
  bool Next(std::uint64_t round, CarriedPlane* plane) {
    if (cells_.size() < kMinCells) return false;
    const ScoredAnchors scored(std::span<const AnchorCell>(cells_), std::max<std::size_t>(1, cells_.size() / kMaxScored));
    std::vector<std::pair<std::size_t, ImagePlane>> drawn(kDraws);
    std::atomic<std::size_t> most = 1;  // a count so far: with fewer none is the best
    tbb::parallel_for(0, kDraws, [&](int draw) {
      auto& [count, candidate] = drawn[static_cast<std::size_t>(draw)];
      if (!Draw(round, static_cast<std::uint32_t>(draw), &candidate)) return;
      count = scored.CountInliers(candidate, most - 1);
      if (count > most) most = count;
    });
    const auto fewer = [](const auto& p, const auto& q) { return p.first < q.first; };
    const auto best = std::max_element(drawn.begin(), drawn.end(), fewer);
    if (best->first == 0) return false;
    *plane = {best->second, {}};
    for (int pass = 0; pass < 3; ++pass) {
      if (!Refine(plane)) return false;
    }
    std::erase_if(cells_, [&](const AnchorCell& cell) {
      if (!IsOn(*plane, cell)) return false;
      plane->cells.push_back(cell);
      return true;
    });
    return true;
  }

 private:
  // A cell at that place, by `word` among those of several depths; null: there is none.
  const AnchorCell* CellAt(int column, int row, std::uint32_t word) const {
    const auto before = [](const AnchorCell& cell, const std::pair<int, int>& place) {
      return std::pair(cell.column, cell.row) < place;
    };
    const auto begin = std::lower_bound(cells_.begin(), cells_.end(), std::pair(column, row), before);
    auto end = begin;  // mostly one or two cells on
    while (end != cells_.end() && end->column == column && end->row == row) ++end;
    return begin == end ? nullptr : &begin[static_cast<std::ptrdiff_t>(IndexOf(word, static_cast<std::size_t>(end - begin)))];
  }

  bool Draw(std::uint64_t round, std::uint32_t draw, ImagePlane* plane) const {
    const Random4 first = Philox(key_, round, draw, 0);
    const AnchorCell* corners[3] = {&cells_[IndexOf(first.v[0], cells_.size())]};
    const float reach = std::exp2(kMinReach + (kMaxReach - kMinReach) * UniformFloat(first.v[1]));  // cells
    int found = 1;
    for (std::uint32_t attempt = 1; attempt <= kAttempts && found < 3; ++attempt) {
      const Random4 random = Philox(key_, round, draw, attempt);
      const auto offset = [&](int i) { return static_cast<int>(std::lround(SymmetricFloat(random.v[i]) * reach)); };
      const AnchorCell* cell = CellAt(corners[0]->column + offset(0), corners[0]->row + offset(1), random.v[2]);
      if (cell != nullptr) corners[found++] = cell;
    }
    return found == 3 && PlaneThrough(*corners[0], *corners[1], *corners[2], 0.5 * side_ * side_ * reach, plane);
  }

  // Least squares over the cells on the plane; false where they are too few.
  bool Refine(ImagePlane* plane) const {
    PlaneFit fit(cells_[0].x, cells_[0].y);
    for (const AnchorCell& cell : cells_) {
      if (IsOn(*plane, cell)) fit.Add(cell, 1 / (cell.tolerance * cell.tolerance));
    }
    if (fit.count() < kMinCells) return false;
    fit.Solve(plane);
    return true;
  }

  std::vector<AnchorCell> cells_;  // by column, row and depth
  float side_;
  RandomKey key_;
};

}  // namespace

std::vector<CarriedPlane> FindScenePlanes(const InferenceInput& input, const AnchorTolerance& tolerance, const Rules& rules) {
  std::vector<CarriedPlane> planes;
  if (!rules.IsOn(Rule::kScenePlanes)) return planes;
  const float side = CellSide(input.measured->width());
  const int min_points = rules.Count(Rule::kScenePlanes, kMinCellPoints);
  constexpr std::uint32_t kSeed = 1;  // the regions' own draws have 0
  PlaneSearch search(MakeAnchorCells(MeasuredPoints(input), side, min_points, tolerance), side,
                     {kSeed, input.reference.view->image_id});
  CarriedPlane plane;
  for (std::uint64_t round = 0; round < kMaxPlanes && search.Next(round, &plane); ++round) planes.push_back(plane);
  return planes;
}

}  // namespace phi

#include "phi/inference/anchor_visibility.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>

#include <tbb/parallel_for.h>

#include "phi/inference/free_space.h"
#include "phi/matching/cost_aggregation.h"

namespace phi {
namespace {

constexpr int kReachPixels = 32;     // pixels; a measured normal carries its plane about so far
constexpr int kMinHiding = 2;  // of the four directions
// Of a cell's side: four samples of each view that looks from the same distance.
constexpr int kCellSteps = 2;
constexpr int kMinBefore = 3;  // points before a gap: one or two may be mistakes

// The points by the cell that they land in, the cells one after the other.
class Cells {
 public:
  Cells(int width, int height, int side, const std::vector<PooledAnchor>& points)
      : begin_(static_cast<std::size_t>((width + side - 1) / side) * ((height + side - 1) / side) + 1, 0),
        points_(points.size()) {
    const auto cell = [&](const PooledAnchor& p) {
      return static_cast<std::size_t>(p.PixelY() / side) * ((width + side - 1) / side) + p.PixelX() / side;
    };
    for (const PooledAnchor& p : points) ++begin_[cell(p) + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
      points_[next[cell(points[i])]++] = static_cast<std::uint32_t>(i);
    }
  }

  std::size_t size() const { return begin_.size() - 1; }
  std::uint32_t* begin(std::size_t cell) { return points_.data() + begin_[cell]; }
  std::uint32_t* end(std::size_t cell) { return points_.data() + begin_[cell + 1]; }

 private:
  std::vector<std::uint32_t> begin_, points_;
};

}  // namespace

Surroundings::Surroundings(const InferenceInput& input, const Rules& rules)
    : rays_(MakeRayModel(input.reference.view->camera.pinhole)), measured_(*input.measured), rules_(rules) {
  const std::size_t num_views =
      std::min<std::size_t>({input.sources.size(), input.source_depths.size(), kMaxSourceViews});
  for (std::size_t j = 0; j < num_views; ++j) {
    if (input.source_depths[j] == nullptr) continue;
    views_.push_back(MakeRelativeView(input.reference.view->camera, input.sources[j].view->camera));
    source_depths_.push_back(input.source_depths[j]->view());
  }
}

// At (x, y) of the plane of the nearest measured pixel in direction (dx, dy); 0: there is none within reach.
float Surroundings::ContinuedDepth(int x, int y, int dx, int dy) const {
  const ArrayView2D<const PixelState> states = measured_.states.view();
  const int reach = rules_.Count(Rule::kHiddenAnchors, kReachPixels);
  for (int i = 1; i <= reach && states.Contains(x + i * dx, y + i * dy); ++i) {
    if (IsMeasured(states(x + i * dx, y + i * dy))) {
      const PlaneHypothesis& h = measured_.planes(x + i * dx, y + i * dy);
      return PlaneDepthAt(rays_, h, x + i * dx + 0.5f, y + i * dy + 0.5f, x + 0.5f, y + 0.5f);
    }
  }
  return 0;
}

bool Surroundings::IsSeenThrough(int x, int y, float inverse_depth) const {
  DepthEvidence evidence;
  for (std::size_t j = 0; j < views_.size(); ++j) {
    AddEvidence(views_[j], source_depths_[j], x + 0.5f, y + 0.5f, inverse_depth, &evidence,
                rules_.Scale(Rule::kFreeSpace));
  }
  return evidence.SeenThrough();
}

bool Surroundings::Hide(int x, int y, float inverse_depth) const {
  constexpr int kDirections[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
  const float gap = rules_.Scale(Rule::kHiddenAnchors) * kDepthGap;
  int num_hiding = 0, num_others = 0;
  for (const auto& direction : kDirections) {
    const float depth = ContinuedDepth(x, y, direction[0], direction[1]);
    if (!(depth > 0)) continue;
    const bool hides = depth * inverse_depth < 1 - gap && !IsSeenThrough(x, y, 1 / depth);
    num_hiding += hides;
    num_others += !hides;
  }
  return num_hiding >= rules_.Count(Rule::kHiddenAnchors, kMinHiding) && num_hiding > num_others;
}

void RemoveHidden(int width, int height, int step, std::vector<PooledAnchor>* pooled, const Rules& rules) {
  const float gap = rules.Scale(Rule::kHiddenAnchors) * kDepthGap;
  const int min_before = rules.Count(Rule::kHiddenAnchors, kMinBefore);
  std::vector<PooledAnchor>& points = *pooled;
  Cells cells(width, height, rules.Count(Rule::kHiddenAnchors, kCellSteps) * step, points);
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t cell) {
    std::uint32_t *begin = cells.begin(cell), *end = cells.end(cell);
    if (end - begin <= min_before) return;
    std::sort(begin, end, [&](std::uint32_t a, std::uint32_t b) {
      return points[a].inverse_depth > points[b].inverse_depth;
    });
    std::uint32_t* hidden = begin + min_before;
    while (hidden != end && points[*hidden].inverse_depth > (1 - gap) * points[hidden[-1]].inverse_depth) {
      ++hidden;
    }
    for (; hidden != end; ++hidden) points[*hidden].inverse_depth = 0;
  });
  std::erase_if(points, [](const PooledAnchor& p) { return !(p.inverse_depth > 0); });
}

}  // namespace phi

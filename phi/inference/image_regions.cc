#include "phi/inference/image_regions.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/box_sums.h"
#include "phi/base/image_noise.h"
#include "phi/base/join_squares.h"
#include "phi/base/whole_array.h"
#include "phi/base/wide_vectors.h"
#include "phi/inference/connected_runs.h"
#include "phi/inference/creases.h"
#include "phi/inference/pooled_anchors.h"
#include "phi/inference/region_parts.h"

namespace phi {
namespace {

// Between neighbours of one region, in grey levels of the image smoothed twice by 3 x 3 pixels; where the image is
// noisier, so many times its noise. Steps of noise alone have a standard deviation of 0.13 times that of the noise.
constexpr double kMaxStep = 4.0 / 3, kMaxStepOverNoise = 0.45;
constexpr int kSumsPerGreyLevel = 81;
// So wide, in pixels, is an image for each pixel of the margin: so near an uneven pixel none is inside a region. What joins two surfaces
// of one colour is a faint piece of the edge between them; its length goes with the image's size, and it is no way through if it is
// shorter than two margins.
constexpr int kWidthOfMargin = 768;
// The same of half a neck. A piece that is longer than two margins still leaves a way that is narrow beside the surfaces: where an even
// area is no wider than a neck it does not join two cores, which lie farther than half a neck from what is uneven and have more pixels
// than the square of the 32nd part of the width. Specks, no larger than half the square of a neck, are noise and no edges.
constexpr int kWidthOfNeck = 96, kWidthOfCore = 32;
// Pixels beyond its inside and the margin to which a region goes on: of a sharp edge two by smoothing, one by the step to the next.
constexpr int kEdgePixels = 3;
constexpr int kBandRows = 64;  // done by one thread
constexpr std::int32_t kNoRegion = -1;

using BrightnessSums = Array2D<std::uint16_t>;

// Whether no step of brightness leads from a pixel to any of its neighbours. No short circuit, so that loops become vector instructions.
inline std::uint8_t IsEven(int own, int above, int below, int left, int right, int max_step) {
  const auto alike = [&](int other) -> int { return std::abs(own - other) <= max_step; };
  return (alike(above) & alike(below) & alike(left) & alike(right)) != 0 ? 255 : 0;
}

// A row and those beside it.
struct RowOfSums {
  const std::uint16_t *above, *own, *below;
};

// Of the pixels of a row from `begin` to before `end`, which have neighbours on either side.
PHI_WIDE_VECTORS void FindEvenBetween(RowOfSums row, int max_step, int begin, int end, std::uint8_t* even) {
  for (int x = begin; x < end; ++x) {
    even[x] = IsEven(row.own[x], row.above[x], row.below[x], row.own[x - 1], row.own[x + 1], max_step);
  }
}

// The same of all of row y; beyond the image nothing is unlike.
void FindEven(const BrightnessSums& sums, int max_step, int y, std::uint8_t* even) {
  const int width = sums.width();
  const std::uint16_t* own = &sums(0, y);
  const RowOfSums row = {y > 0 ? &sums(0, y - 1) : own, own, y + 1 < sums.height() ? &sums(0, y + 1) : own};
  FindEvenBetween(row, max_step, 1, width - 1, even);
  for (const int x : {0, width - 1}) {
    even[x] = IsEven(own[x], row.above[x], row.below[x], own[std::max(x - 1, 0)], own[std::min(x + 1, width - 1)], max_step);
  }
}

constexpr auto kBoth = [](std::uint8_t a, std::uint8_t b) -> std::uint8_t { return a & b; };

// Where all pixels up to `margin` away are even.
Mask FindInside(const BrightnessSums& sums, int max_step, int margin) {
  const int width = sums.width(), height = sums.height(), num_bands = (height + kBandRows - 1) / kBandRows;
  Mask inside = Mask::Uninitialized(width, height);
  tbb::parallel_for(0, num_bands, [&](int band) {
    const int begin = band * kBandRows, end = std::min(begin + kBandRows, height);
    const int first = std::max(begin - margin, 0), last = std::min(end + margin, height) - 1;
    Mask even(width, last - first + 1);
    for (int y = first; y <= last; ++y) FindEven(sums, max_step, y, &even(0, y - first));
    for (int y = begin; y < end; ++y) JoinSquares(even, margin, y - first, kBoth, &inside(0, y));
  });
  return inside;
}

// The sum of what is inside no region: more than any pixel's, so that nothing is alike.
constexpr std::uint16_t kOutside = 65535, kUnlike = kOutside - 255 * kSumsPerGreyLevel;

BrightnessSums SumsInside(const BrightnessSums& sums, const Mask& inside) {
  auto result = BrightnessSums::Uninitialized(sums.width(), sums.height());
  tbb::parallel_for(0, sums.height(), [&](int y) {
    for (int x = 0; x < sums.width(); ++x) result(x, y) = inside(x, y) != 0 ? sums(x, y) : kOutside;
  });
  return result;
}

// Segments of rows in which nothing, or all, lies inside a region are passed over: most of a textured image, most of a wall.
constexpr int kSegment = 64;  // pixels, more than any reach

// Of a segment's pixels: their sums, and what they are most alike so far: by which difference, at which place.
struct MostAlike {
  std::uint16_t own[kSegment], least[kSegment], best[kSegment];
};

// Asks the pixels at `num_places` places of one row, one beside the other; `other`: the first one's for the segment's first pixel.
PHI_WIDE_VECTORS void TakeMoreAlike(const std::uint16_t* __restrict other, int num_places, std::uint16_t place,
                                    MostAlike* __restrict found) {
  for (int k = 0; k < num_places; ++k, ++other, ++place) {
    for (int x = 0; x < kSegment; ++x) {
      const std::uint16_t own = found->own[x];
      const std::uint16_t difference = other[x] > own ? other[x] - own : own - other[x];
      const bool is_best = difference < found->least[x];
      found->least[x] = is_best ? difference : found->least[x];
      found->best[x] = is_best ? place : found->best[x];
    }
  }
}

struct Segments {
  Mask has_inside, has_outside;  // of segment (column, y)

  explicit Segments(const Mask& inside)
      : has_inside((inside.width() + kSegment - 1) / kSegment, inside.height()),
        has_outside(has_inside.width(), inside.height()) {
    tbb::parallel_for(0, inside.height(), [&](int y) {
      for (int x = 0; x < inside.width(); ++x) {
        (inside(x, y) != 0 ? has_inside : has_outside)(x / kSegment, y) = 255;
      }
    });
  }

  // Whether any is inside in the segment of row y and those beside it.
  bool HasInsideNear(int column, int y) const {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, has_inside.width() - 1); ++c) {
      if (has_inside(c, y) != 0) return true;
    }
    return false;
  }
};

// Gives the pixels that are inside no region the region of the most alike of those at most `reach` away that are inside one; the first
// in the square around the pixel, row by row.
class RegionExtension {
 public:
  // References must outlive it.
  RegionExtension(const BrightnessSums& sums, const Mask& inside, int reach)
      : sums_(sums), inside_(inside), sums_inside_(SumsInside(sums, inside)), segments_(inside), reach_(reach) {}

  void ExtendRow(int y, Array2D<std::int32_t>* region) const {
    for (int column = 0; column < segments_.has_inside.width(); ++column) {
      if (segments_.has_outside(column, y) != 0) ExtendSegment(column, y, region);
    }
  }

 private:
  void ExtendSegment(int column, int y, Array2D<std::int32_t>* region) const {
    constexpr std::uint16_t kNone = 65535;
    const int begin = column * kSegment, end = std::min(begin + kSegment, sums_.width()), side = 2 * reach_ + 1;
    MostAlike found;
    std::fill(std::copy(&sums_(begin, y), &sums_(begin, y) + (end - begin), found.own), std::end(found.own), std::uint16_t{0});
    std::fill(std::begin(found.least), std::end(found.least), kUnlike);
    std::fill(std::begin(found.best), std::end(found.best), kNone);
    // Beyond the image nothing is alike.
    std::array<std::uint16_t, 3 * kSegment> row;
    row.fill(kOutside);
    const int first = std::max(begin - reach_, 0), last = std::min(begin + kSegment + reach_, sums_.width());
    for (int v = std::max(y - reach_, 0); v <= std::min(y + reach_, sums_.height() - 1); ++v) {
      if (!segments_.HasInsideNear(column, v)) continue;
      const std::uint16_t* others = &sums_inside_(0, v);
      std::copy(others + first, others + last, row.begin() + (first - (begin - reach_)));
      TakeMoreAlike(row.data(), side, static_cast<std::uint16_t>((v - y + reach_) * side), &found);
    }
    for (int x = begin; x < end; ++x) {
      const int place = found.best[x - begin];
      if (inside_(x, y) == 0 && place != kNone) (*region)(x, y) = (*region)(x + place % side - reach_, y + place / side - reach_);
    }
  }

  const BrightnessSums& sums_;
  const Mask& inside_;
  const BrightnessSums sums_inside_;
  const Segments segments_;
  const int reach_;
};

int MarginOf(int width, const Rules& rules) {
  const int margin = std::max((width + kWidthOfMargin / 2) / kWidthOfMargin, 1);
  return std::min(rules.Count(Rule::kEvenRegions, margin), kSegment - kEdgePixels - 1);
}

// `inside` and its specks: connected pixels outside, no more than `most` of them.
Mask WithSpecks(const Mask& inside, std::int64_t most) {
  const auto outside = Transformed(inside, [](std::uint8_t is_inside) -> std::uint8_t { return ~is_inside; });
  const ConnectedRuns pieces = FindConnectedRuns(outside);
  Mask areas = inside;
  for (const PixelRun& run : pieces.runs) {
    if (pieces.sizes[static_cast<std::size_t>(run.label)] > most) continue;
    std::fill(areas.data() + run.begin, areas.data() + run.end, std::uint8_t{255});
  }
  return areas;
}

// What of the even areas lies farther than a neck's half width from their border.
Mask FindWide(const Mask& inside, int margin, const Rules& rules) {
  const int half_width = rules.Count(Rule::kEvenRegions, (inside.width() + kWidthOfNeck / 2) / kWidthOfNeck);
  if (half_width <= margin) return inside;
  const Mask areas = WithSpecks(inside, std::int64_t{2} * half_width * half_width);
  Mask wide = Mask::Uninitialized(inside.width(), inside.height());
  tbb::parallel_for(0, inside.height(), [&](int y) {
    JoinSquares(areas, half_width - margin, y, kBoth, &wide(0, y));
    for (int x = 0; x < inside.width(); ++x) wide(x, y) &= inside(x, y);
  });
  return wide;
}

}  // namespace

ImageRegions FindRegions(const GrayImage& image, const Rules& rules) {
  if (!rules.IsOn(Rule::kRegionPlanes))
    return {Array2D<std::int32_t>(image.width(), image.height(), kNoRegion), 0};
  const int margin = MarginOf(image.width(), rules), reach = margin + kEdgePixels;
  const BrightnessSums sums = SumBoxes3x3Twice(image.view());
  const double max_grey_step =
      rules.Scale(Rule::kEvenRegions) * std::max(kMaxStep, kMaxStepOverNoise * NoiseDeviation(image.view()));
  const auto max_step = static_cast<int>(kSumsPerGreyLevel * max_grey_step);
  const Mask inside = FindInside(sums, max_step, margin);
  const std::int64_t core_side = image.width() / kWidthOfCore;
  ImageRegions regions = PartAtNecks(inside, FindWide(inside, margin, rules), core_side * core_side);
  const RegionExtension extension(sums, inside, reach);
  tbb::parallel_for(0, image.height(), [&](int y) { extension.ExtendRow(y, &regions.region); });
  if (rules.IsOn(Rule::kContinuedRegions)) {
    const auto max_change = static_cast<int>(kSumsPerGreyLevel * kMaxBrightnessChange);
    regions.continued = FindContinuedRegions(regions.region, regions.num_regions, sums, max_change, reach);
  }
  if (rules.IsOn(Rule::kCreases)) regions.creases = FindCreases(regions.region);
  return regions;
}

}  // namespace phi

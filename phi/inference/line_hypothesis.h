// Plane hypotheses along scanlines: each run of pixels without depth gets a line through the nearest six reconstructed
// pixels, three a side where they exist. Four directions give four hypotheses a pixel.
//
// Along any scanline of a plane inverse depth is affine, so lines are fitted in inverse depth (robust) and are exact on
// planes of any slant. The paper fits depth, without bounds.
//
// A line of one side alone says where a surface goes on, not where it ends. Where the image is even, nothing there contradicts
// it: the sky above a roof would take the roof's depth. There a line goes between two sides only. Nor do clues just above the roof
// carry lines across the sky, where the region may be that; where views show that it is, there is none.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/geometry/depth_agreement.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/options.h"

namespace phi {

inline constexpr int kNumDirections = 4;
// Planes of an even region of the image (region_planes.h), which take the diagonals' places among the hypotheses.
inline constexpr int kPlanesPerRegion = 2;
enum Direction { kHorizontal = 0, kVertical = 1, kDescending = 2, kAscending = 3 };  // diagonals as x grows

// What limits lines at a pixel.
enum LineLimit : std::uint8_t {
  kBetweenSidesOnly = 1,  // the image is even
  kMeasuredOnly = 2,      // it may be the sky: clues are no anchors
  kNoLine = 4,            // it is
  kReflected = 8,         // the pixel's anchor lies behind a mirror
};

// Inverse depth of what lines rest on at a pixel; 0: nothing, or what a mirror shows. anchor: what else rests on it, clues included;
// evidence: what was measured.
PHI_HD float LineAnchor(float anchor, float evidence, std::uint8_t limits) {
  if ((limits & kReflected) != 0) return 0;
  return (limits & kMeasuredOnly) != 0 ? evidence : anchor;
}

struct LineOptions {
  Formulas formulas = Formulas::kRobust;  // paper: lines in depth, no bounds
  // Pixels from the gap within which a side's anchors are looked for, and that a line of one side alone reaches beyond them.
  int max_reach = 16;
  float max_jump = kDepthEdge;  // relative: a gap whose two sides differ by more is a depth edge
  float max_change = 2;         // an extrapolated line never changes the depth of what it rests on by this factor
};

inline LineOptions MakeLineOptions(const Method& method) {
  LineOptions options;
  options.formulas = method.formulas;
  const Rules& rules = method.rules;
  if (rules.IsOn(Rule::kDepthEdges)) {
    options.max_jump *= rules.Factor(Rule::kDepthEdges);
    options.max_change *= rules.Factor(Rule::kDepthEdges);
    options.max_reach = rules.Count(Rule::kDepthEdges, options.max_reach);
  } else {
    options.max_jump = options.max_change = std::numeric_limits<float>::infinity();
  }
  return options;
}

// The pixels (x0 + t * dx, y0 + t * dy), 0 <= t < length.
struct Scanline {
  int x0, y0, dx, dy, length;
};

PHI_HD int NumScanlines(int direction, int width, int height) {
  return direction == kHorizontal ? height : direction == kVertical ? width : width + height - 1;
}

PHI_HD Scanline MakeScanline(int direction, int index, int width, int height) {
  if (direction == kHorizontal) return {0, index, 1, 0, width};
  if (direction == kVertical) return {index, 0, 0, 1, height};
  const int x0 = index < height ? 0 : index - height + 1;
  if (direction == kDescending) {
    const int y0 = index < height ? height - 1 - index : 0;
    return {x0, y0, 1, 1, width - x0 < height - y0 ? width - x0 : height - y0};
  }
  const int y0 = index < height ? index : height - 1;
  return {x0, y0, 1, -1, width - x0 < y0 + 1 ? width - x0 : y0 + 1};
}

// Sums for a line through a few points. They are relative to the first one, the nearest to the gap: on the far side of a wide gap the
// squares of positions in the gap would leave single precision nothing for the slope.
struct LineSums {
  float n = 0, t = 0, tt = 0, w = 0, tw = 0;
  float nearest_t = 0, nearest_w = 0;
  float min_w = 0, max_w = 0;

  PHI_HD void Add(float position, float value) {
    if (n == 0) nearest_t = position, nearest_w = min_w = max_w = value;
    const float dt = position - nearest_t, dw = value - nearest_w;
    n += 1;
    t += dt;
    tt += dt * dt;
    w += dw;
    tw += dt * dw;
    min_w = Min(min_w, value);
    max_w = Max(max_w, value);
  }
};

// value(t) = value + slope * (t - origin).
struct Line {
  float origin = 0, value = 0, slope = 0;
  PHI_HD float At(float t) const { return value + slope * (t - origin); }
};

// Least squares; a single point gives a level line.
PHI_HD Line FitLine(const LineSums& s) {
  const float mt = s.t / s.n, mw = s.w / s.n;
  const float ctt = s.tt - s.t * mt, ctw = s.tw - s.t * mw;
  return {s.nearest_t + mt, s.nearest_w + mw, s.n >= 2 ? ctw / ctt : 0.0f};
}

// Least squares through both sides' points. `a` and `b` hold positions on one axis.
PHI_HD Line FitLine(const LineSums& a, const LineSums& b) {
  const float dt = b.nearest_t - a.nearest_t, dw = b.nearest_w - a.nearest_w;
  LineSums s = a;
  s.n += b.n;
  s.t += b.t + b.n * dt;
  s.tt += b.tt + (2 * b.t + b.n * dt) * dt;
  s.w += b.w + b.n * dw;
  s.tw += b.tw + b.t * dw + (b.w + b.n * dw) * dt;
  return FitLine(s);
}

// One side of a gap: the position beside the gap, and the way from there, 1 or -1.
struct GapSide {
  int first, step;
};

// The anchors on a side of a gap, nearest first: walks until `max_count` are found, the surface breaks, or `max_reach` ends.
// Positions are stored relative to `origin`. `anchors`: inverse depths, 0 = none.
PHI_HD LineSums CollectSide(const Scanline& line, ArrayView2D<const float> anchors, const LineOptions& options, GapSide side,
                            int max_count, int origin) {
  const bool fits_depth = options.formulas == Formulas::kPaper;
  LineSums sums;
  int t = side.first;
  for (int walked = 0; t >= 0 && t < line.length && static_cast<int>(sums.n) < max_count;
       t += side.step, ++walked) {
    if (!fits_depth && walked >= options.max_reach) break;
    const float w = anchors(line.x0 + t * line.dx, line.y0 + t * line.dy);
    if (!(w > 0)) continue;
    if (!fits_depth && sums.n > 0 && !(fabsf(w - sums.nearest_w) < kSameSurface * sums.nearest_w)) break;
    sums.Add(static_cast<float>(t - origin), fits_depth ? 1 / w : w);
  }
  return sums;
}

// What fills one gap: a line across it, or a bounded piece from either side.
struct GapModel {
  bool across = false;
  bool has_before = false, has_after = false;
  Line line, before, after;            // positions relative to the gap's first pixel
  float begin = 0, end = 0;            // positions of the anchors nearest to the gap
  float min_value = 0, max_value = 0;  // of the anchors
};

// Whether the two sides are one surface.
PHI_HD bool SidesMeet(const LineSums& before, const LineSums& after, const LineOptions& options) {
  const float jump = fabsf(after.nearest_w - before.nearest_w);
  return jump < options.max_jump * Min(before.nearest_w, after.nearest_w);
}

// The gap is [begin, end): positions without an anchor.
PHI_HD GapModel FitGap(const Scanline& line, ArrayView2D<const float> anchors, const LineOptions& options,
                       int begin, int end) {
  const bool open_before = begin > 0, open_after = end < line.length;
  const GapSide side_before = {begin - 1, -1}, side_after = {end, 1};
  LineSums before, after;
  if (open_before) before = CollectSide(line, anchors, options, side_before, open_after ? 3 : 6, begin);
  if (open_after) after = CollectSide(line, anchors, options, side_after, open_before ? 3 : 6, begin);
  // The paper's are always the closest six: what one side lacks the other one gives.
  if (options.formulas == Formulas::kPaper && after.n < 3) {
    before = CollectSide(line, anchors, options, side_before, 6 - static_cast<int>(after.n), begin);
  } else if (options.formulas == Formulas::kPaper && before.n < 3) {
    after = CollectSide(line, anchors, options, side_after, 6 - static_cast<int>(before.n), begin);
  }
  GapModel model;
  model.has_before = before.n > 0;
  model.has_after = after.n > 0;
  model.begin = before.nearest_t;
  model.end = after.nearest_t;
  if (model.has_before) model.before = FitLine(before);
  if (model.has_after) model.after = FitLine(after);
  if (model.has_before && model.has_after &&
      (options.formulas == Formulas::kPaper || SidesMeet(before, after, options))) {
    model.across = true;
    model.line = FitLine(before, after);
  }
  const LineSums& any = model.has_before ? before : after;
  model.min_value = model.has_after ? Min(any.min_w, after.min_w) : any.min_w;
  model.max_value = model.has_after ? Max(any.max_w, after.max_w) : any.max_w;
  return model;
}

// Value at position t of the gap, relative to its first pixel; 0 = no hypothesis. is_even: the image, there.
PHI_HD float GapValue(const GapModel& model, const LineOptions& options, float t, bool is_even) {
  if (model.across) return model.line.At(t);
  if (is_even) return 0;
  const float from_before = model.has_before ? t - model.begin : 1e9f;
  const float from_after = model.has_after ? model.end - t : 1e9f;
  const float distance = Min(from_before, from_after);
  if (distance >= 1e9f) return 0;
  const bool is_far = distance > static_cast<float>(options.max_reach);
  if (options.formulas == Formulas::kRobust && is_far) return 0;
  const float value = from_before <= from_after ? model.before.At(t) : model.after.At(t);
  if (options.formulas == Formulas::kPaper) return value > 0 ? value : 0;
  return options.max_change * value > model.min_value && value < options.max_change * model.max_value ? value
                                                                                                      : 0;
}

// Fills position s of the gap that begins at `begin`, where nothing is yet. `hypothesis`: inverse depth, 0: none; `limits`: LineLimit bits;
// no data: none.
PHI_HD void FillGapPosition(const Scanline& line, const GapModel& model, ArrayView2D<const std::uint8_t> limits, const LineOptions& options,
                            int begin, int s, ArrayView2D<float> hypothesis) {
  const int x = line.x0 + s * line.dx, y = line.y0 + s * line.dy;
  float& target = hypothesis(x, y);
  if (target > 0) return;
  const std::uint8_t limit = limits.data != nullptr ? limits(x, y) : 0;
  if ((limit & kNoLine) != 0) return;
  const float value = GapValue(model, options, static_cast<float>(s - begin), (limit & kBetweenSidesOnly) != 0);
  target = value > 0 ? (options.formulas == Formulas::kPaper ? 1 / value : value) : 0;
}

// Fills the gaps between one scanline's anchors (inverse depths, 0 = none). `hypothesis` holds the anchors on entry and 0 elsewhere;
// only zeros are written. One call per scanline may run in parallel within a direction.
PHI_HD void FillScanline(const Scanline& line, ArrayView2D<const float> anchors,
                         ArrayView2D<const std::uint8_t> limits, const LineOptions& options,
                         ArrayView2D<float> hypothesis) {
  int t = 0;
  while (t < line.length) {
    if (anchors(line.x0 + t * line.dx, line.y0 + t * line.dy) > 0) {
      ++t;
      continue;
    }
    const int begin = t;
    while (t < line.length && !(anchors(line.x0 + t * line.dx, line.y0 + t * line.dy) > 0)) ++t;
    if (begin == 0 && t == line.length) return;
    const GapModel model = FitGap(line, anchors, options, begin, t);
    for (int s = begin; s < t; ++s) FillGapPosition(line, model, limits, options, begin, s, hypothesis);
  }
}

}  // namespace phi

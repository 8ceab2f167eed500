#include "phi/cpu/cpu_estimation.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "phi/cpu/cpu_context.h"
#include "phi/cpu/estimation_work.h"
#include "phi/matching/coarse_start.h"
#include "phi/matching/estimate_pixel.h"
#include "phi/matching/estimation_setup.h"
#include "phi/matching/first_hypothesis.h"
#include "phi/matching/pyramid.h"
#include "phi/nearest_point_ranges.h"

namespace phi {
namespace {

void Run(const CpuContext& context, const CoarseHypotheses& coarse, EstimationWork* work) {
  const EstimationParameters& p = context.parameters;
  const int width = p.reference.width, height = p.reference.height;
  ForEachRow(height, [&](int y) {
    const CpuContext of_row = context;
    for (int x = 0; x < width; ++x) {
      InitializePixelState(of_row, x, y, FirstHypothesis(p, coarse, context.state.ranges, x, y));
    }
    work->RowDone(width, EstimationWork::kFirstHypotheses, of_row.counts);
  });
  for (int iteration = p.first_iteration; iteration < p.end_iteration; ++iteration) {
    for (int colour = 0; colour < 2; ++colour) {
      ForEachRow(height, [&](int y) {
        CpuContext of_row = context;
        const int first_x = (y + colour) & 1;
        of_row.bests.Find(context.state.cost, first_x, y);
        for (int x = first_x; x < width; x += 2) UpdatePixel(of_row, x, y, iteration);
        work->RowDone(width, EstimationWork::kHalfPassHypotheses, of_row.counts);
      });
    }
  }
}

// The images that a part at `level` works on.
void ReduceImages(int level, EstimationInput* input) {
  const auto reduce = [level](ViewImage* view) {
    for (int i = 0; i < level; ++i) {
      view->image = std::make_shared<const GrayImage>(HalveImage(*view->image));
    }
  };
  reduce(&input->reference);
  for (ViewImage& source : input->sources) reduce(&source);
}

EstimationResult EstimatePart(const PartInput& part, const CoarseHypotheses& coarse, const DepthRanges& ranges,
                              EstimationWork* work) {
  const EstimationParameters parameters = part.Parameters();
  PlaneMap plane(parameters.reference.width, parameters.reference.height);
  CostMap cost(plane.width(), plane.height());
  Array2D<std::uint8_t> changed(plane.width(), plane.height());
  const SimdMatcher matcher(part.input(), parameters, MakeRelativeViews(part.input()));
  const CpuContext context{parameters, {plane.view(), cost.view(), changed.view(), ranges}, matcher};
  Run(context, coarse, work);
  return {std::move(plane), std::move(cost), {}};
}

// Of the coarsest part; the cells cover more pixels of a finer one.
DepthRangeMap RangesOf(const EstimationInput& input) {
  const Pinhole& size = input.reference.view->camera.pinhole;
  return NearestPointDepthRanges(input.sparse, size.width, size.height);
}

}  // namespace

EstimationResult EstimateOnCpu(const EstimationInput& input, const StereoOptions& options) {
  const std::vector<EstimationPart> parts = EstimationParts(input, options);
  const Pinhole& size = input.reference.view->camera.pinhole;
  EstimationWork work(parts, size.width, size.height, input.tell_progress);
  const DepthRangeMap ranges = RangesOf(PartInput(input, options, parts.front()).input());
  EstimationResult result;
  int coarser_level = parts.front().level;
  for (const EstimationPart& part : parts) {
    PartInput of_part(input, options, part);
    ReduceImages(part.level, &of_part.input());
    const PlaneMap coarse = std::move(result.map);
    result = EstimatePart(of_part, {coarse.view(), coarser_level - part.level},
                          {ranges.view(), kDepthRangeCell << (parts.front().level - part.level)}, &work);
    coarser_level = part.level;
  }
  result.counts = work.counts();
  return result;
}

}  // namespace phi

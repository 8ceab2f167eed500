#include "cuda/memory_plan.h"

#include <algorithm>
#include <span>
#include <vector>

#include "cuda/estimation_kernels.h"
#include "cuda/scratch.h"
#include "phi/matching/propagation.h"

namespace phi::gpu {
namespace {

// The cache frees an image or map that is no longer used after it has uploaded the next one.
constexpr int kInTransit = 1;

std::int64_t ImageBytes(const ViewImage& reference, std::span<const ViewImage> sources) {
  const auto bytes = [](const ViewImage& view) {
    return static_cast<std::int64_t>(GrayPyramid::Bytes(view.image->width(), view.image->height()));
  };
  std::int64_t sum = bytes(reference), largest = sum;
  for (const ViewImage& source : sources) {
    sum += bytes(source);
    largest = std::max(largest, bytes(source));
  }
  return sum + kInTransit * largest;
}

// Bytes of an estimation beside the images: what is there for all rows, and per row of the state.
struct EstimationSizes {
  std::int64_t fixed = 0;
  std::int64_t width = 0;
  std::int64_t row = 0;           // the pixels' state
  std::int64_t coarse_width = 0;   // pixels on two rows that a coarser part had; 0: there is none

  EstimationSizes(const EstimationInput& input, bool coarse_start) {
    width = input.reference.image->width();
    const std::int64_t height = input.reference.image->height();
    if (coarse_start) coarse_width = (width + 1) / 2;
    fixed = 2 * width * height * sizeof(std::uint8_t);  // scales of the windows, and whether pixels changed
    row = width * (sizeof(PlaneHypothesis) + sizeof(float));
  }

  std::int64_t CoarsePixels(std::int64_t rows) const { return coarse_width * ((rows + 1) / 2); }
  std::int64_t CoarseBytes(std::int64_t rows) const { return CoarsePixels(rows) * sizeof(PlaneHypothesis); }
  std::int64_t NoteBytes(std::int64_t rows) const { return NumHalfPassNotes(width, rows) * sizeof(HalfPassNote); }
  std::int64_t Whole(std::int64_t rows) const {
    return fixed + rows * row + CoarseBytes(rows) + NoteBytes(rows);
  }
  std::int64_t InBands(std::int64_t rows) const {
    return fixed + (rows + 2 * kPropagationReach) * row + CoarseBytes(rows) + NoteBytes(rows);
  }
};

// Of the sources that have one, with their masks.
struct SourceMaps {
  std::int64_t largest = 0;  // bytes
  int count = 0;

  SourceMaps(const std::vector<SourceMap>& sources, std::int64_t reference_bytes) : largest(reference_bytes) {
    for (const SourceMap& source : sources) {
      if (source.load == nullptr) continue;
      ++count;
      const Pinhole& size = source.view->camera.pinhole;  // not read yet: a map has its camera's size
      const std::size_t mask_bytes = source.load_mask ? sizeof(std::uint8_t) : 0;
      largest = std::max(largest, std::int64_t{size.width} * size.height *
                                      static_cast<std::int64_t>(sizeof(PlaneHypothesis) + mask_bytes));
    }
  }

  // How many so many bytes hold, beside the one in transit.
  int NumAtOnce(std::int64_t bytes) const {
    return static_cast<int>(std::min<std::int64_t>(std::max(count, 1), bytes / largest - kInTransit));
  }
};

int RoundUpToTiles(std::int64_t rows) {
  return static_cast<int>((rows + kTileSide - 1) / kTileSide * kTileSide);
}

}  // namespace

std::int64_t EstimationBytes(const EstimationInput& input, bool coarse_start) {
  return ImageBytes(input.reference, input.sources) +
         EstimationSizes(input, coarse_start).Whole(input.reference.image->height());
}

EstimationPlan PlanEstimation(const EstimationInput& input, std::int64_t budget, const Task& task,
                              bool coarse_start) {
  const EstimationSizes sizes(input, coarse_start);
  const std::int64_t height = input.reference.image->height();
  const std::int64_t whole = EstimationBytes(input, coarse_start);
  if (whole <= budget) return {0, sizes.CoarsePixels(height), whole};
  const std::int64_t images = ImageBytes(input.reference, input.sources);
  const std::int64_t none = images + sizes.InBands(0), tile = images + sizes.InBands(kTileSide) - none;
  if (none + tile > budget) ThrowTooLittleMemory(none + tile, budget, task);
  const std::int64_t most_rows = (budget - none) / tile * kTileSide;
  const std::int64_t num_bands = (height + most_rows - 1) / most_rows;
  const int rows = RoundUpToTiles((height + num_bands - 1) / num_bands);
  return {rows, sizes.CoarsePixels(rows), images + sizes.InBands(rows)};
}

SharingPlan PlanSharing(const SharingInput& input, std::int64_t budget, const Task& task) {
  const std::int64_t width = input.own.map->width(), height = input.own.map->height();
  const std::int64_t own = static_cast<std::int64_t>(input.own.map->planes.bytes());
  const SourceMaps maps(input.sources, own);
  // The image's own map and the scales of its windows.
  const std::int64_t fixed = ImageBytes(input.estimation.reference, input.estimation.sources) + own +
                             width * height * static_cast<std::int64_t>(sizeof(std::uint8_t));
  const std::int64_t row = width * SharingScratch::kBandPixelBytes;
  const std::int64_t of_one = fixed + (1 + kInTransit) * maps.largest;
  if (of_one + height * row <= budget) {
    const int at_once = maps.NumAtOnce(budget - fixed - height * row);
    return {at_once, static_cast<int>(height), fixed + (at_once + kInTransit) * maps.largest + height * row};
  }
  const std::int64_t tile = kTileSide * row;
  if (of_one + tile > budget) ThrowTooLittleMemory(of_one + tile, budget, task);
  const int rows = static_cast<int>((budget - of_one) / tile * kTileSide);
  return {1, rows, of_one + rows * row};
}

FilterPlan PlanFilter(const FilterInput& input, std::int64_t budget, const Task& task) {
  const std::int64_t num_pixels = static_cast<std::int64_t>(input.reference.map->size());
  const std::int64_t reference_bytes = static_cast<std::int64_t>(input.reference.map->planes.bytes());
  std::int64_t fixed = reference_bytes + num_pixels * static_cast<std::int64_t>(sizeof(Testimonies));
  if (input.cost != nullptr) fixed += num_pixels * sizeof(float);
  fixed += static_cast<std::int64_t>(input.reference.map->states.bytes());
  if (input.judgement) {
    fixed += num_pixels * JudgementScratch::kPixelBytes + static_cast<std::int64_t>(GrayPyramid::Bytes(task.width, task.height));
  } else {
    fixed += num_pixels * static_cast<std::int64_t>(sizeof(FilterVerdict));
  }
  const SourceMaps maps(input.sources, reference_bytes);
  const std::int64_t smallest = fixed + (1 + kInTransit) * maps.largest;
  if (smallest > budget) ThrowTooLittleMemory(smallest, budget, task);
  const int at_once = maps.NumAtOnce(budget - fixed);
  return {at_once, fixed + (at_once + kInTransit) * maps.largest};
}

std::int64_t PlanInference(const InferenceInput& input, std::int64_t budget, const Task& task) {
  const std::int64_t width = input.measured->width(), height = input.measured->height();
  const std::int64_t nodes = std::int64_t{NumNodesAlong(input.measured->width())} * NumNodesAlong(input.measured->height());
  const std::size_t num_matched = input.NumMatched();
  std::int64_t depth_bytes = 0;
  for (std::size_t j = 0; j < num_matched; ++j) {
    const auto depths = input.DepthsOf(j);
    if (depths != nullptr) depth_bytes += static_cast<std::int64_t>(depths->bytes());
  }
  const std::int64_t bytes = depth_bytes + width * height * InferenceScratch::kPixelBytes +
                             nodes * InferenceScratch::kNodeBytes +
                             ImageBytes(input.reference, std::span(input.sources).first(num_matched));
  if (bytes > budget) ThrowTooLittleMemory(bytes, budget, task);
  return bytes;
}

}  // namespace phi::gpu

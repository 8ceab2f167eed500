// Launches of the estimation's passes (paper section C). Kernels run phi/matching/estimate_pixel.h per pixel.
#pragma once

#include <cuda_runtime_api.h>

#include "cuda/error.h"
#include "cuda/gray_texture.h"
#include "cuda/texture_sampler.h"
#include "phi/matching/estimate_pixel.h"
#include "phi/matching/first_hypothesis.h"
#include "phi/matching/window_level.h"

namespace phi::gpu {

inline constexpr int kTileSide = 16;  // pixels on a side of a block's tile: 128 of each colour

// What the matching cost needs of a source view: see phi::RelativeView for a and b.
struct SourceView {
  Mat3f a;
  Vec3f b;
  int width = 0, height = 0;  // of level 0
  TextureSampler textures[kMaxPyramidLevels];
};

// 1 << pyramid level, the range step, and a bit for the narrow window.
inline constexpr std::uint8_t kNarrowWindowBit = 0x80;
inline constexpr int kRangeStepShift = kMaxPyramidLevels;
static_assert(kMaxRangeStep << kRangeStepShift < kNarrowWindowBit);
PHI_HD std::uint8_t PackWindowScale(WindowScale scale) {
  return static_cast<std::uint8_t>(1 << scale.level | scale.range_step << kRangeStepShift |
                                   (scale.is_narrow ? kNarrowWindowBit : 0));
}
// All but the level, which kernels take from the bit.
PHI_HD WindowScale UnpackWindowScale(std::uint8_t packed) {
  return {0, (packed & kNarrowWindowBit) != 0,
          static_cast<std::uint8_t>(packed >> kRangeStepShift & kMaxRangeStep)};
}

// What the kernels of a ranked half-pass tell each other of a pixel.
struct HalfPassNote {
  std::int8_t dx[kNumFinalists] = {}, dy[kNumFinalists] = {};  // where the candidates come from; 0, 0: there is none
  std::uint8_t promising = 0;                                  // variant

  PHI_HD bool HasFinalist(int i) const { return dx[i] != 0 || dy[i] != 0; }
};

// Room for those of so many rows: all threads of their tiles have one.
PHI_HD std::int64_t NumHalfPassNotes(std::int64_t width, std::int64_t num_rows) {
  constexpr int kPerTile = kTileSide * kTileSide / 2;
  return (width + kTileSide - 1) / kTileSide * ((num_rows + kTileSide - 1) / kTileSide) * kPerTile;
}

// Passed to the kernels by value: no device globals, so that several references and GPUs run at once.
struct EstimationLaunch {
  EstimationParameters parameters;
  EstimationState state;           // of all rows; of planes and costs only first_row to end_row and what those read need be there
  int first_row = 0, end_row = 0;  // the rows to work on; first_row is a multiple of kTileSide
  unsigned long long* num_samples = nullptr;  // counts the source samples that were read, on the device
  TextureSampler reference[kMaxPyramidLevels];
  ArrayView2D<std::uint8_t>
      window_scales;  // of each pixel, see PackWindowScale; LaunchWindowScales writes it
  HalfPassNote* notes = nullptr;  // NumHalfPassNotes of the rows to work on, on the device; for half-passes that rank
  SourceView sources[kMaxSourceViews];
};

void LaunchWindowScales(const EstimationLaunch& launch, cudaStream_t stream, const Task& task);

// The first hypotheses come from `coarse` where it has data, else from EstimationState::ranges.
void LaunchInitialization(const EstimationLaunch& launch, const CoarseHypotheses& coarse, cudaStream_t stream,
                          const Task& task);

// One colour of the checkerboard, 0 and then 1 in each iteration.
void LaunchHalfPass(const EstimationLaunch& launch, int iteration, int colour, cudaStream_t stream,
                    const Task& task);

// The same where sparse samples rank.
void LaunchRankedHalfPass(const EstimationLaunch& launch, int iteration, int colour, cudaStream_t stream,
                          const Task& task);

// The cost of each pixel's hypothesis in each source view: costs[view][pixel]. For tests.
void LaunchViewCosts(const EstimationLaunch& launch, ArrayView2D<const PlaneHypothesis> hypotheses, Samples samples,
                     float* costs, cudaStream_t stream, const Task& task);

}  // namespace phi::gpu

// Launches of what judges the pixels of an estimate that the filter has asked the views about. The kernels run
// phi/filtering/judge_pixel.h per pixel.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "cuda/error.h"
#include "cuda/texture_sampler.h"
#include "phi/filtering/filter_pixel.h"
#include "phi/filtering/judge_pixel.h"

namespace phi::gpu {

// On the device; JudgementReference's.
struct OwnTextureArrays {
  ArrayView2D<std::uint16_t> sums;
  ArrayView2D<std::uint8_t> is_plain;
};

// All of `judgement` is on the device; its sums and, where they are asked, plain pixels are these arrays, which are filled here.
void LaunchOwnTexture(const JudgementReference& judgement, TextureSampler photo, const OwnTextureArrays& arrays, cudaStream_t stream,
                      const Task& task);

// The states of the pixels, by all that the sources said.
void LaunchMeasure(const FilterReference& filter, const JudgementReference& judgement, ArrayView2D<const Testimonies> testimonies,
                   ArrayView2D<PixelState> states, cudaStream_t stream, const Task& task);

}  // namespace phi::gpu

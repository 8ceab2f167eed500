// Launches of the sharing of hypotheses. Kernels run phi/matching/share_pixel.h per pixel.
#pragma once

#include <cuda_runtime_api.h>

#include "cuda/estimation_kernels.h"
#include "phi/matching/share_pixel.h"

namespace phi::gpu {

// The views take the whole image's coordinates, and hold rows `first_row` to before `end_row` alone, but for own planes.
struct SharingLaunch {
  EstimationParameters parameters;
  OffersView offers;
  ArrayView2D<NearestPixel> nearest;
  int first_row = 0, end_row = 0;
};

// One source after the other.
void LaunchHearSource(const SharingLaunch& launch, const OfferingSource& source, cudaStream_t stream,
                      const Task& task);

// Then, once. matching: of the rows of `launch`; its state does not count.
void LaunchChoosePlanes(const EstimationLaunch& matching, const OffersView& offers, cudaStream_t stream,
                        const Task& task);

}  // namespace phi::gpu

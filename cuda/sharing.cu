#include "cuda/estimation_variants.cuh"
#include "cuda/pixel_grid.cuh"
#include "cuda/sharing_kernels.h"

namespace phi::gpu {
namespace {

constexpr dim3 kBlock(32, 8);

__global__ void ForgetNearestKernel(const __grid_constant__ SharingLaunch launch) {
  const int x = ThreadX(), y = launch.first_row + ThreadY();
  if (x < launch.nearest.width && y < launch.end_row) launch.nearest(x, y) = kNoPixel;
}

__global__ void FindNearestKernel(const __grid_constant__ SharingLaunch launch,
                                  const __grid_constant__ OfferingSource source) {
  const int x = ThreadX(), y = ThreadY();
  FallenPixel fallen;
  if (!source.planes.Contains(x, y) || !FallOnReference(source, launch.parameters.reference, x, y, &fallen))
    return;
  if (fallen.y < launch.first_row || fallen.y >= launch.end_row ||
      launch.offers.IsSettled(fallen.x, fallen.y))
    return;
  static_assert(sizeof(unsigned long long) == sizeof(NearestPixel));
  const NearestPixel found =
      PackNearest(fallen.depth, static_cast<std::uint32_t>(y * source.planes.width + x));
  atomicMin(reinterpret_cast<unsigned long long*>(&launch.nearest(fallen.x, fallen.y)),
            static_cast<unsigned long long>(found));
}

__global__ void HearKernel(const __grid_constant__ SharingLaunch launch,
                           const __grid_constant__ OfferingSource source) {
  const int x = ThreadX(), y = launch.first_row + ThreadY();
  if (x >= launch.nearest.width || y >= launch.end_row) return;
  HearOffer(launch.parameters, source, launch.nearest(x, y), launch.offers, x, y);
}

template <class V>
__global__ void __launch_bounds__(kThreads)
    ChooseKernel(const __grid_constant__ EstimationLaunch matching, OffersView offers, int colour) {
  const PixelPosition pixel = CheckerboardPixel(threadIdx.x, colour, matching.first_row);
  const typename V::Context context(matching);
  if (offers.own.Contains(pixel.x, pixel.y) && pixel.y < matching.end_row)
    ChoosePlane(context, offers, pixel.x, pixel.y);
  context.CountSamples();
}

}  // namespace

void LaunchHearSource(const SharingLaunch& launch, const OfferingSource& source, cudaStream_t stream,
                      const Task& task) {
  const dim3 pixels = PixelGrid(launch.nearest.width, launch.end_row - launch.first_row, kBlock);
  ForgetNearestKernel<<<pixels, kBlock, 0, stream>>>(launch);
  CheckLaunch("ForgetNearestKernel", task);
  FindNearestKernel<<<PixelGrid(source.planes.width, source.planes.height, kBlock), kBlock, 0, stream>>>(launch, source);
  CheckLaunch("FindNearestKernel", task);
  HearKernel<<<pixels, kBlock, 0, stream>>>(launch, source);
  CheckLaunch("HearKernel", task);
}

void LaunchChoosePlanes(const EstimationLaunch& matching, const OffersView& offers, cudaStream_t stream,
                        const Task& task) {
  WithVariant<Samples::kAll>(matching, [&](auto variant) {
    using V = decltype(variant);
    for (int colour = 0; colour < 2; ++colour) {
      LaunchVariant<V>("ChooseKernel", ChooseKernel<V>, matching, stream, task, offers, colour);
    }
  });
}

}  // namespace phi::gpu

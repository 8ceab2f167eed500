#include "cuda/estimation_variants.cuh"

namespace phi::gpu {
namespace {

__global__ void __launch_bounds__(kThreads)
    WindowScaleKernel(const __grid_constant__ EstimationLaunch launch, int colour) {
  const PixelPosition pixel = CheckerboardPixel(threadIdx.x, colour, launch.first_row);
  if (!launch.window_scales.Contains(pixel.x, pixel.y)) return;
  launch.window_scales(pixel.x, pixel.y) =
      PackWindowScale(SelectWindowScale(launch.reference, launch.parameters.num_levels,
                                        launch.parameters.window, pixel.x + 0.5f, pixel.y + 0.5f));
}

template <class V>
__global__ void __launch_bounds__(kThreads)
    InitializeKernel(const __grid_constant__ EstimationLaunch launch, CoarseHypotheses coarse, int colour) {
  const PixelPosition pixel = CheckerboardPixel(threadIdx.x, colour, launch.first_row);
  const typename V::Context context(launch);
  if (launch.state.plane.Contains(pixel.x, pixel.y)) {
    const PlaneHypothesis hypothesis =
        FirstHypothesis(launch.parameters, coarse, launch.state.ranges, pixel.x, pixel.y);
    InitializePixelState(context, pixel.x, pixel.y, hypothesis);
  }
  context.CountSamples();
}

template <class V>
__global__ void __launch_bounds__(kThreads)
    UpdateByAllSamplesKernel(const __grid_constant__ EstimationLaunch launch, int iteration, int colour) {
  const PixelPosition pixel = CheckerboardPixel(threadIdx.x, colour, launch.first_row);
  const typename V::Context context(launch);
  if (launch.state.plane.Contains(pixel.x, pixel.y)) {
    UpdateByAllSamples(context, pixel.x, pixel.y, iteration);
  }
  context.CountSamples();
}

template <class V>
__global__ void __launch_bounds__(kThreads)
    ViewCostsKernel(const __grid_constant__ EstimationLaunch launch,
                    ArrayView2D<const PlaneHypothesis> hypotheses, float* costs, int colour) {
  const PixelPosition pixel = CheckerboardPixel(threadIdx.x, colour, launch.first_row);
  if (!hypotheses.Contains(pixel.x, pixel.y)) return;
  const typename V::Context context(launch);
  const std::int64_t index = static_cast<std::int64_t>(pixel.y) * hypotheses.width + pixel.x;
  context.ForEachView(context.LoadPatch(pixel.x, pixel.y), pixel.x, pixel.y, hypotheses(pixel.x, pixel.y),
                      [&](int j, float cost) { costs[j * hypotheses.size() + index] = cost; });
}

}  // namespace

void LaunchWindowScales(const EstimationLaunch& launch, cudaStream_t stream, const Task& task) {
  for (int colour = 0; colour < 2; ++colour) {
    WindowScaleKernel<<<HalfPassGrid(launch), kThreads, 0, stream>>>(launch, colour);
    CheckLaunch("WindowScaleKernel", task);
  }
}

void LaunchInitialization(const EstimationLaunch& launch, const CoarseHypotheses& coarse, cudaStream_t stream,
                          const Task& task) {
  WithVariant<Samples::kAll>(launch, [&](auto variant) {
    using V = decltype(variant);
    for (int colour = 0; colour < 2; ++colour) {
      LaunchVariant<V>("InitializeKernel", InitializeKernel<V>, launch, stream, task, coarse, colour);
    }
  });
}

void LaunchHalfPass(const EstimationLaunch& launch, int iteration, int colour, cudaStream_t stream,
                    const Task& task) {
  if (launch.parameters.ranks) return LaunchRankedHalfPass(launch, iteration, colour, stream, task);
  WithVariant<Samples::kAll>(launch, [&](auto variant) {
    using V = decltype(variant);
    LaunchVariant<V>("UpdateByAllSamplesKernel", UpdateByAllSamplesKernel<V>, launch, stream, task, iteration, colour);
  });
}

void LaunchViewCosts(const EstimationLaunch& launch, ArrayView2D<const PlaneHypothesis> hypotheses, Samples samples,
                     float* costs, cudaStream_t stream, const Task& task) {
  const auto launch_kernel = [&](auto variant) {
    using V = decltype(variant);
    for (int colour = 0; colour < 2; ++colour) {
      LaunchVariant<V>("ViewCostsKernel", ViewCostsKernel<V>, launch, stream, task, hypotheses, costs, colour);
    }
  };
  if (samples == Samples::kSparse) {
    WithVariant<Samples::kSparse>(launch, launch_kernel);
  } else {
    WithVariant<Samples::kAll>(launch, launch_kernel);
  }
}

}  // namespace phi::gpu

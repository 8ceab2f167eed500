#include <type_traits>

#include "cuda/checkerboard.cuh"
#include "cuda/estimation_kernels.h"
#include "cuda/matching_context.cuh"

namespace phi::gpu {
namespace {

__global__ void __launch_bounds__(kThreads)
    WindowLevelKernel(const __grid_constant__ EstimationLaunch launch, int colour) {
  const PixelPosition pixel = CheckerboardPixel(colour);
  if (!launch.window_levels.Contains(pixel.x, pixel.y)) return;
  const int level = SelectWindowLevel(launch.reference, launch.parameters.num_levels,
                                      launch.parameters.window, pixel.x + 0.5f, pixel.y + 0.5f);
  launch.window_levels(pixel.x, pixel.y) = static_cast<std::uint8_t>(1 << level);
}

template <int kViews, int kSide>
__global__ void __launch_bounds__(kThreads)
    InitializeKernel(const __grid_constant__ EstimationLaunch launch, InitialDepths initial, int colour) {
  const PixelPosition pixel = CheckerboardPixel(colour);
  if (!launch.state.plane.Contains(pixel.x, pixel.y)) return;
  PlaneHypothesis hypothesis;
  if (initial.hypotheses.data != nullptr) hypothesis = initial.hypotheses(pixel.x, pixel.y);
  if (!(hypothesis.depth > 0)) {
    const float2 range = initial.ranges(pixel.x / initial.cell, pixel.y / initial.cell);
    hypothesis = FirstHypothesis(launch.parameters, range.x, range.y, pixel.x, pixel.y);
  }
  InitializePixelState<kViews>(GpuContext<kSide>(launch), pixel.x, pixel.y, hypothesis);
}

template <int kViews, int kSide>
__global__ void __launch_bounds__(kThreads)
    UpdateKernel(const __grid_constant__ EstimationLaunch launch, int iteration, int colour) {
  const PixelPosition pixel = CheckerboardPixel(colour);
  if (!launch.state.plane.Contains(pixel.x, pixel.y)) return;
  UpdatePixel<kViews>(GpuContext<kSide>(launch), pixel.x, pixel.y, iteration);
}

template <int kSide>
__global__ void __launch_bounds__(kThreads)
    ViewCostsKernel(const __grid_constant__ EstimationLaunch launch,
                    ArrayView2D<const PlaneHypothesis> hypotheses, float* costs, int colour) {
  const PixelPosition pixel = CheckerboardPixel(colour);
  if (!hypotheses.Contains(pixel.x, pixel.y)) return;
  const GpuContext<kSide> context(launch);
  float pixel_costs[kMaxSourceViews];
  context.Costs(context.LoadPatch(pixel.x, pixel.y), pixel.x, pixel.y, hypotheses(pixel.x, pixel.y),
                kAllViews, pixel_costs);
  const std::int64_t index = static_cast<std::int64_t>(pixel.y) * hypotheses.width + pixel.x;
  for (int j = 0; j < launch.parameters.num_views; ++j) costs[j * hypotheses.size() + index] = pixel_costs[j];
}

template <int kValue>
using Constant = std::integral_constant<int, kValue>;

// Calls function(Constant<kSide>) with a compiled window, or 0 for any other.
template <class Function>
void WithWindow(const EstimationLaunch& launch, const Function& function) {
  switch (2 * launch.parameters.window.samples_per_side + 1) {
    case 11:
      return function(Constant<11>());
    default:
      return function(Constant<0>());
  }
}

// Calls function(Constant<kViews>, Constant<kSide>).
template <class Function>
void WithViewsAndWindow(const EstimationLaunch& launch, const Function& function) {
  WithWindow(launch, [&](auto side) {
    if (launch.parameters.num_views <= 8) {
      function(Constant<8>(), side);
    } else {
      function(Constant<kMaxSourceViews>(), side);
    }
  });
}

// Lets a kernel use `bytes` of dynamic shared memory, which needs a permission above 48 KB.
template <class Kernel>
int AllowSharedMemory(Kernel kernel, int bytes, const Task& task) {
  Check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes),
        "cudaFuncSetAttribute", task);
  return bytes;
}

dim3 Grid(const EstimationLaunch& launch) {
  return CheckerboardGrid(launch.parameters.reference.width, launch.parameters.reference.height);
}

}  // namespace

void LaunchWindowLevels(const EstimationLaunch& launch, cudaStream_t stream, const Task& task) {
  for (int colour = 0; colour < 2; ++colour) {
    WindowLevelKernel<<<Grid(launch), kThreads, 0, stream>>>(launch, colour);
    CheckLaunch("WindowLevelKernel", task);
  }
}

void LaunchInitialization(const EstimationLaunch& launch, const InitialDepths& initial, cudaStream_t stream,
                          const Task& task) {
  WithViewsAndWindow(launch, [&](auto views, auto side) {
    const auto kernel = InitializeKernel<views.value, side.value>;
    const int shared = AllowSharedMemory(kernel, ReferenceWindow<side.value>::kSharedBytes, task);
    for (int colour = 0; colour < 2; ++colour) {
      kernel<<<Grid(launch), kThreads, shared, stream>>>(launch, initial, colour);
      CheckLaunch("InitializeKernel", task);
    }
  });
}

void LaunchIteration(const EstimationLaunch& launch, int iteration, cudaStream_t stream, const Task& task) {
  WithViewsAndWindow(launch, [&](auto views, auto side) {
    const auto kernel = UpdateKernel<views.value, side.value>;
    const int shared = AllowSharedMemory(kernel, ReferenceWindow<side.value>::kSharedBytes, task);
    for (int colour = 0; colour < 2; ++colour) {
      kernel<<<Grid(launch), kThreads, shared, stream>>>(launch, iteration, colour);
      CheckLaunch("UpdateKernel", task);
    }
  });
}

void LaunchViewCosts(const EstimationLaunch& launch, ArrayView2D<const PlaneHypothesis> hypotheses,
                     float* costs, cudaStream_t stream, const Task& task) {
  WithWindow(launch, [&](auto side) {
    const auto kernel = ViewCostsKernel<side.value>;
    const int shared = AllowSharedMemory(kernel, ReferenceWindow<side.value>::kSharedBytes, task);
    for (int colour = 0; colour < 2; ++colour) {
      kernel<<<Grid(launch), kThreads, shared, stream>>>(launch, hypotheses, costs, colour);
      CheckLaunch("ViewCostsKernel", task);
    }
  });
}

}  // namespace phi::gpu

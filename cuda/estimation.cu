#include "cuda/checkerboard.cuh"
#include "cuda/estimation_kernels.h"
#include "cuda/matching_context.cuh"

namespace phi::gpu {
namespace {

__global__ void __launch_bounds__(kThreads)
    WindowScaleKernel(const __grid_constant__ EstimationLaunch launch, int colour) {
  const PixelPosition pixel = CheckerboardPixel(colour, launch.first_row);
  if (!launch.window_scales.Contains(pixel.x, pixel.y)) return;
  launch.window_scales(pixel.x, pixel.y) =
      PackWindowScale(SelectWindowScale(launch.reference, launch.parameters.num_levels,
                                        launch.parameters.window, pixel.x + 0.5f, pixel.y + 0.5f));
}

// kSide: samples on a side of the window, or 0 for any.
template <int kSide, ImageForm kForm>
struct Variant {
  using Context = GpuContext<kSide, kForm>;
  static constexpr int kSharedBytes = ReferenceWindow<kSide, kForm>::kSharedBytes;
};

template <class V>
__global__ void __launch_bounds__(kThreads)
    InitializeKernel(const __grid_constant__ EstimationLaunch launch, InitialDepths initial, int colour) {
  const PixelPosition pixel = CheckerboardPixel(colour, launch.first_row);
  const typename V::Context context(launch);
  if (launch.state.plane.Contains(pixel.x, pixel.y)) {
    PlaneHypothesis hypothesis;
    if (initial.hypotheses.data != nullptr) hypothesis = initial.hypotheses(pixel.x, pixel.y);
    if (!(hypothesis.depth > 0) &&
        (initial.coarse.map.data == nullptr ||
         !HypothesisFromCoarse(launch.parameters, initial.coarse, pixel.x, pixel.y, &hypothesis))) {
      const DepthRange near = launch.state.ranges.At(pixel.x, pixel.y);
      hypothesis = FirstHypothesis(launch.parameters, near, pixel.x, pixel.y);
    }
    InitializePixelState(context, pixel.x, pixel.y, hypothesis);
  }
  context.CountSamples();
}

template <class V>
__global__ void __launch_bounds__(kThreads)
    UpdateKernel(const __grid_constant__ EstimationLaunch launch, int iteration, int colour) {
  const PixelPosition pixel = CheckerboardPixel(colour, launch.first_row);
  const typename V::Context context(launch);
  if (launch.state.plane.Contains(pixel.x, pixel.y)) {
    UpdatePixel(context, pixel.x, pixel.y, iteration);
  }
  context.CountSamples();
}

template <class V>
__global__ void __launch_bounds__(kThreads)
    ViewCostsKernel(const __grid_constant__ EstimationLaunch launch,
                    ArrayView2D<const PlaneHypothesis> hypotheses, Samples samples, float* costs, int colour) {
  const PixelPosition pixel = CheckerboardPixel(colour, launch.first_row);
  if (!hypotheses.Contains(pixel.x, pixel.y)) return;
  const typename V::Context context(launch);
  const std::int64_t index = static_cast<std::int64_t>(pixel.y) * hypotheses.width + pixel.x;
  context.ForEachView(context.LoadPatch(pixel.x, pixel.y), pixel.x, pixel.y, hypotheses(pixel.x, pixel.y), samples,
                      [&](int j, float cost) { costs[j * hypotheses.size() + index] = cost; });
}

// Calls function(Variant) with the compiled window, or the general one, which reads through textures alone.
template <class Function>
void WithVariant(const EstimationLaunch& launch, const Function& function) {
  constexpr int kSide = 11;
  if (2 * launch.parameters.window.samples_per_side + 1 != kSide) {
    function(Variant<0, ImageForm::kCompact>());
  } else if (launch.form == ImageForm::kCompact) {
    function(Variant<kSide, ImageForm::kCompact>());
  } else {
    function(Variant<kSide, ImageForm::kQuads>());
  }
}

// Lets a kernel use `bytes` of dynamic shared memory, which needs a permission above 48 KB.
template <class Kernel>
int AllowSharedMemory(Kernel kernel, int bytes, const Task& task) {
  Check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes),
        "cudaFuncSetAttribute", task);
  return bytes;
}

dim3 Grid(const EstimationLaunch& launch) {
  return CheckerboardGrid(launch.parameters.reference.width, launch.end_row - launch.first_row);
}

}  // namespace

void LaunchWindowScales(const EstimationLaunch& launch, cudaStream_t stream, const Task& task) {
  for (int colour = 0; colour < 2; ++colour) {
    WindowScaleKernel<<<Grid(launch), kThreads, 0, stream>>>(launch, colour);
    CheckLaunch("WindowScaleKernel", task);
  }
}

void LaunchInitialization(const EstimationLaunch& launch, const InitialDepths& initial, cudaStream_t stream,
                          const Task& task) {
  WithVariant(launch, [&](auto variant) {
    const auto kernel = InitializeKernel<decltype(variant)>;
    const int shared = AllowSharedMemory(kernel, variant.kSharedBytes, task);
    for (int colour = 0; colour < 2; ++colour) {
      kernel<<<Grid(launch), kThreads, shared, stream>>>(launch, initial, colour);
      CheckLaunch("InitializeKernel", task);
    }
  });
}

void LaunchHalfPass(const EstimationLaunch& launch, int iteration, int colour, cudaStream_t stream,
                    const Task& task) {
  WithVariant(launch, [&](auto variant) {
    const auto kernel = UpdateKernel<decltype(variant)>;
    const int shared = AllowSharedMemory(kernel, variant.kSharedBytes, task);
    kernel<<<Grid(launch), kThreads, shared, stream>>>(launch, iteration, colour);
    CheckLaunch("UpdateKernel", task);
  });
}

void LaunchViewCosts(const EstimationLaunch& launch, ArrayView2D<const PlaneHypothesis> hypotheses, Samples samples,
                     float* costs, cudaStream_t stream, const Task& task) {
  WithVariant(launch, [&](auto variant) {
    const auto kernel = ViewCostsKernel<decltype(variant)>;
    const int shared = AllowSharedMemory(kernel, variant.kSharedBytes, task);
    for (int colour = 0; colour < 2; ++colour) {
      kernel<<<Grid(launch), kThreads, shared, stream>>>(launch, hypotheses, samples, costs, colour);
      CheckLaunch("ViewCostsKernel", task);
    }
  });
}

}  // namespace phi::gpu

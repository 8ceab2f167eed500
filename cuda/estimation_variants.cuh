// The forms that the estimation's kernels are compiled in, and how they are launched.
#pragma once

#include "cuda/checkerboard.cuh"
#include "cuda/estimation_kernels.h"
#include "cuda/matching_context.cuh"

namespace phi::gpu {

// kSide: samples on a side of the window, or 0 for any.
template <int kSide, Samples kSamples>
struct Variant {
  using Context = GpuContext<kSide, kSamples>;
  static constexpr int kSharedBytes = ReferenceWindow<kSide, kSamples>::kSharedBytes;
};

// Calls function(Variant) with the compiled window, or the general one.
template <Samples kSamples, class Function>
void WithVariant(const EstimationLaunch& launch, const Function& function) {
  constexpr int kSide = 11;
  if (2 * launch.parameters.window.samples_per_side + 1 != kSide) {
    function(Variant<0, kSamples>());
  } else {
    function(Variant<kSide, kSamples>());
  }
}

// Lets a kernel use `bytes` of dynamic shared memory, which needs a permission above 48 KB.
template <class Kernel>
int AllowSharedMemory(Kernel kernel, int bytes, const Task& task) {
  Check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes),
        "cudaFuncSetAttribute", task);
  return bytes;
}

inline dim3 HalfPassGrid(const EstimationLaunch& launch) {
  return CheckerboardGrid(launch.parameters.reference.width, launch.end_row - launch.first_row);
}

// On the pixels of one colour. `arguments`: the kernel's behind the launch.
template <class V, class Kernel, class... Arguments>
void LaunchVariant(const char* name, Kernel kernel, const EstimationLaunch& launch, cudaStream_t stream, const Task& task,
                   Arguments... arguments) {
  const int shared = AllowSharedMemory(kernel, V::kSharedBytes, task);
  kernel<<<HalfPassGrid(launch), kThreads, shared, stream>>>(launch, arguments...);
  CheckLaunch(name, task);
}

}  // namespace phi::gpu

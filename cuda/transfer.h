// Copies and clears of arrays, queued on a stream.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "cuda/error.h"

namespace phi::gpu {

// `count` elements. Of page-locked memory of the host it returns at once, else when the driver has read it.
template <typename T>
void CopyToDevice(T* device, const T* host, std::int64_t count, cudaStream_t stream, const Task& task) {
  Check(cudaMemcpyAsync(device, host, static_cast<std::size_t>(count) * sizeof(T), cudaMemcpyHostToDevice, stream),
        "cudaMemcpyAsync to the device", task);
}
template <typename T>
void CopyToHost(T* host, const T* device, std::int64_t count, cudaStream_t stream, const Task& task) {
  Check(cudaMemcpyAsync(host, device, static_cast<std::size_t>(count) * sizeof(T), cudaMemcpyDeviceToHost, stream),
        "cudaMemcpyAsync to the host", task);
}
template <typename T>
void CopyOnDevice(T* to, const T* from, std::int64_t count, cudaStream_t stream, const Task& task) {
  Check(cudaMemcpyAsync(to, from, static_cast<std::size_t>(count) * sizeof(T), cudaMemcpyDeviceToDevice, stream),
        "cudaMemcpyAsync on the device", task);
}

// All bytes 0.
template <typename T>
void ClearOnDevice(T* device, std::int64_t count, cudaStream_t stream, const Task& task) {
  Check(cudaMemsetAsync(device, 0, static_cast<std::size_t>(count) * sizeof(T), stream), "cudaMemsetAsync", task);
}

}  // namespace phi::gpu

// Owners of device memory and of page-locked host memory. Elements are trivially copyable and start uninitialised.
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>

#include "cuda/error.h"
#include "cuda/transfer.h"
#include "phi/base/array2d.h"

namespace phi::gpu {

template <typename T>
class DeviceBuffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  DeviceBuffer() = default;
  DeviceBuffer(std::int64_t size, const Task& task) { Reserve(size, task); }
  ~DeviceBuffer() { cudaFree(data_); }
  DeviceBuffer(DeviceBuffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), capacity_(std::exchange(other.capacity_, 0)) {}
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(capacity_, other.capacity_);
    return *this;
  }

  // Room for `size` elements; keeps what is there when it is large enough, else the content is lost.
  void Reserve(std::int64_t size, const Task& task) {
    if (size <= capacity_) return;
    cudaFree(std::exchange(data_, nullptr));
    capacity_ = 0;
    const std::size_t bytes = static_cast<std::size_t>(size) * sizeof(T);
    CheckAllocation(cudaMalloc(reinterpret_cast<void**>(&data_), bytes), "cudaMalloc", bytes, task);
    capacity_ = size;
  }

  void Free() {
    cudaFree(std::exchange(data_, nullptr));
    capacity_ = 0;
  }

  T* data() const { return data_; }
  std::size_t bytes() const { return static_cast<std::size_t>(capacity_) * sizeof(T); }
  ArrayView2D<T> View(int width, int height) const { return {data_, width, height}; }

  void Upload(const T* host, std::int64_t size, cudaStream_t stream, const Task& task) const {
    UploadAt(0, host, size, stream, task);
  }
  void UploadAt(std::int64_t first, const T* host, std::int64_t size, cudaStream_t stream,
                const Task& task) const {
    CopyToDevice(data_ + first, host, size, stream, task);
  }

 private:
  T* data_ = nullptr;
  std::int64_t capacity_ = 0;
};

// Page-locked memory: copies from the device run at the bus's rate and beside kernels.
template <typename T>
class PinnedBuffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  PinnedBuffer() = default;
  ~PinnedBuffer() { cudaFreeHost(data_); }
  PinnedBuffer(const PinnedBuffer&) = delete;
  PinnedBuffer& operator=(const PinnedBuffer&) = delete;

  void Reserve(std::int64_t size, const Task& task) {
    if (size <= capacity_) return;
    cudaFreeHost(std::exchange(data_, nullptr));
    capacity_ = 0;
    const std::size_t bytes = static_cast<std::size_t>(size) * sizeof(T);
    CheckAllocation(cudaMallocHost(reinterpret_cast<void**>(&data_), bytes), "cudaMallocHost (host memory)",
                    bytes, task);
    capacity_ = size;
  }

  void Download(const DeviceBuffer<T>& device, std::int64_t size, cudaStream_t stream, const Task& task) {
    Reserve(size, task);
    CopyToHost(data_, device.data(), size, stream, task);
  }

  T* data() const { return data_; }

 private:
  T* data_ = nullptr;
  std::int64_t capacity_ = 0;
};

}  // namespace phi::gpu

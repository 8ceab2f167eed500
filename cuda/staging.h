// Uploads of the host's arrays by way of page-locked memory that all threads fill. Of other memory the driver copies with one thread,
// a fifth as fast as the bus, and others' uploads wait for it. Images, which are small beside maps, go to arrays without it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include <tbb/task_arena.h>

#include "cuda/buffer.h"
#include "cuda/scratch_pool.h"
#include "cuda/stream.h"
#include "phi/base/whole_array.h"

namespace phi::gpu {

// For one upload at a time (StagingPool).
class Staging {
 public:
  explicit Staging(const Task& task) : stream(task), filling_(task), leaving_(task) {}

  // Of `count` elements, to memory of the device that no kernel uses. Returns once they are there.
  template <typename T>
  void Upload(const T* host, std::int64_t count, T* device, const Task& task) {
    constexpr std::int64_t kPart = kPartBytes / static_cast<std::int64_t>(sizeof(T));
    for (std::int64_t begin = 0; begin < count; begin += kPart) {
      const std::int64_t size = std::min(kPart, count - begin);
      T* part = filling_.Fill(host + begin, size, task);
      CopyToDevice(device + begin, part, size, stream.get(), task);
      filling_.left->Record(stream.get(), task);
      std::swap(filling_, leaving_);
    }
    stream.Synchronize(task);
  }

  void Settle() const { stream.Settle(); }

  Stream stream;

 private:
  static constexpr std::int64_t kPartBytes = std::int64_t{8} << 20;

  // One is filled while the other one is on its way.
  struct Part {
    explicit Part(const Task& task)
        : memory(std::make_unique<PinnedBuffer<std::byte>>()), left(std::make_unique<Event>(Event::Timing::kOff, task)) {}

    template <typename T>
    T* Fill(const T* host, std::int64_t size, const Task& task) {
      memory->Reserve(kPartBytes, task);
      left->Wait(task);
      T* to = reinterpret_cast<T*>(memory->data());
      // Isolated: a thread that waits for the others' share must not begin another call's work, which may wait for this upload.
      tbb::this_task_arena::isolate([&] { CopyAll(host, static_cast<std::size_t>(size), to); });
      return to;
    }

    std::unique_ptr<PinnedBuffer<std::byte>> memory;
    std::unique_ptr<Event> left;  // what was in it last
  };

  Part filling_, leaving_;
};

// Two: one fills its memory while the other one's is on its way; the bus takes one after the other.
class StagingPool {
 public:
  template <typename T>
  void Upload(const T* host, std::int64_t count, T* device, const Task& task) {
    const ScratchPool<Staging>::Lease staging(&pool_, task);
    staging->Upload(host, count, device, task);
  }

  // Frees what no upload holds.
  void FreeIdle() { pool_.FreeIdle(); }

 private:
  ScratchPool<Staging> pool_{2};
};

}  // namespace phi::gpu

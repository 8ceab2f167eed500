// Owners of a stream and of an event.
#pragma once

#include "cuda/error.h"

namespace phi::gpu {

class Event {
 public:
  enum class Timing { kOff, kOn };

  Event(Timing timing, const Task& task) {
    const unsigned flags = timing == Timing::kOn ? cudaEventDefault : cudaEventDisableTiming;
    Check(cudaEventCreateWithFlags(&event_, flags | cudaEventBlockingSync), "cudaEventCreate", task);
  }
  ~Event() { cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  void Record(cudaStream_t stream, const Task& task) const {
    Check(cudaEventRecord(event_, stream), "cudaEventRecord", task);
  }
  // Blocks the host until what was recorded has passed; the thread sleeps, for the cores have other work.
  void Wait(const Task& task) const { Check(cudaEventSynchronize(event_), "cudaEventSynchronize", task); }
  // Seconds of device time between two recorded events with timing that have both passed.
  static double SecondsBetween(const Event& begin, const Event& end, const Task& task) {
    float milliseconds = 0;
    Check(cudaEventElapsedTime(&milliseconds, begin.event_, end.event_), "cudaEventElapsedTime", task);
    return 1e-3 * milliseconds;
  }

 private:
  cudaEvent_t event_ = nullptr;
};

class Stream {
 public:
  // Of kernels that wait for room on the device those of a high priority come first.
  enum class Priority { kLow, kHigh };

  explicit Stream(const Task& task, Priority priority = Priority::kHigh) : done_(Event::Timing::kOff, task) {
    int lowest = 0, highest = 0;
    Check(cudaDeviceGetStreamPriorityRange(&lowest, &highest), "cudaDeviceGetStreamPriorityRange", task);
    Check(cudaStreamCreateWithPriority(&stream_, cudaStreamNonBlocking, priority == Priority::kLow ? lowest : highest),
          "cudaStreamCreateWithPriority", task);
  }
  ~Stream() {
    if (stream_) cudaStreamDestroy(stream_);
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  cudaStream_t get() const { return stream_; }
  // Blocks the host until what was submitted has passed, or has failed: who waits next is told.
  void Settle() const { cudaStreamSynchronize(stream_); }
  // The same; the thread sleeps. Throws where it has failed.
  void Synchronize(const Task& task) const {
    done_.Record(stream_, task);
    done_.Wait(task);
  }

 private:
  cudaStream_t stream_ = nullptr;
  Event done_;
};

}  // namespace phi::gpu

// Writes results beside the computation: a few threads and a bounded queue.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>

#include "colmap_ext/pipeline/thread_group.h"

namespace colmap_ext {

class WriterPool {
 public:
  // A job writes its files and returns the number of bytes it wrote.
  using Job = std::function<std::int64_t()>;

  // Throws phi::ResourceError when the threads cannot be started.
  explicit WriterPool(int num_threads);
  ~WriterPool();  // finishes what was submitted
  WriterPool(const WriterPool&) = delete;
  WriterPool& operator=(const WriterPool&) = delete;

  // Waits while the queue is full (as many jobs as threads). Rethrows the first error of an earlier job.
  void Submit(Job job);
  // Waits until everything is written. Rethrows the first error.
  void Drain();

  std::int64_t bytes_written() const;
  double busy_seconds() const;  // summed over the threads

 private:
  void Work();
  void Stop();
  void RethrowError();

  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> queue_;
  int num_running_ = 0;
  bool stop_ = false;
  std::exception_ptr error_;
  std::int64_t bytes_written_ = 0;
  double busy_seconds_ = 0;
  ThreadGroup threads_;  // last: ends before what it works on
};

}  // namespace colmap_ext

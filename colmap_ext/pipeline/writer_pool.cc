#include "colmap_ext/pipeline/writer_pool.h"

#include <chrono>
#include <utility>

#include "phi/base/error.h"

namespace colmap_ext {

WriterPool::WriterPool(int num_threads) : capacity_(static_cast<std::size_t>(num_threads)) {
  try {
    for (int i = 0; i < num_threads; ++i) threads_.Start([this] { Work(); });
  } catch (...) {
    Stop();  // those that run; the group waits for them
    throw;
  }
}

WriterPool::~WriterPool() { Stop(); }

void WriterPool::Stop() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
}

void WriterPool::Submit(Job job) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return queue_.size() < capacity_ || error_; });
  RethrowError();
  queue_.push_back(std::move(job));
  changed_.notify_all();
}

void WriterPool::Drain() {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return (queue_.empty() && num_running_ == 0) || error_; });
  RethrowError();
}

void WriterPool::RethrowError() {
  if (error_) std::rethrow_exception(error_);
}

void WriterPool::Work() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return !queue_.empty() || stop_; });
    if (queue_.empty()) return;
    const Job job = std::move(queue_.front());
    queue_.pop_front();
    ++num_running_;
    lock.unlock();
    changed_.notify_all();
    const auto begin = std::chrono::steady_clock::now();
    std::int64_t num_bytes = 0;
    std::exception_ptr error;
    try {
      num_bytes = job();
    } catch (const phi::InputError& failure) {
      // A result that cannot be written is not one image's fault: it ends the run.
      error = std::make_exception_ptr(phi::ResourceError(failure.message()));
    } catch (...) {
      error = std::current_exception();
    }
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
    lock.lock();
    --num_running_;
    bytes_written_ += num_bytes;
    busy_seconds_ += elapsed.count();
    if (error && !error_) error_ = error;
    changed_.notify_all();
  }
}

std::int64_t WriterPool::bytes_written() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return bytes_written_;
}

double WriterPool::busy_seconds() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return busy_seconds_;
}

}  // namespace colmap_ext

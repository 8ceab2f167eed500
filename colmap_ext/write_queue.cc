#include "colmap_ext/write_queue.h"

#include <utility>

namespace colmap_ext {

WriteQueue::~WriteQueue() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

template <typename Condition>
void WriteQueue::WaitUntil(std::unique_lock<std::mutex>* lock, const Condition& condition) {
  changed_.wait(*lock, [&] { return failure_ != nullptr || condition(); });
  if (failure_ != nullptr) std::rethrow_exception(failure_);
}

void WriteQueue::Add(std::size_t num_bytes, std::function<void()> write) {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    WaitUntil(&lock, [&] { return num_bytes_ < max_bytes_; });
    waiting_.push_back({num_bytes, std::move(write)});
    num_bytes_ += num_bytes;
    if (!thread_.joinable()) thread_ = std::thread([this] { Run(); });
  }
  changed_.notify_all();
}

void WriteQueue::Finish() {
  std::unique_lock<std::mutex> lock(mutex_);
  WaitUntil(&lock, [&] { return waiting_.empty() && !is_writing_; });
}

void WriteQueue::Run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (failure_ == nullptr) {
    changed_.wait(lock, [&] { return is_ending_ || !waiting_.empty(); });
    if (is_ending_) return;
    Item item = std::move(waiting_.front());
    waiting_.pop_front();
    is_writing_ = true;
    lock.unlock();
    std::exception_ptr failure;
    try {
      item.write();
      item.write = nullptr;  // gives back what it held
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    failure_ = failure;
    num_bytes_ -= item.num_bytes;
    is_writing_ = false;
    changed_.notify_all();
  }
}

}  // namespace colmap_ext

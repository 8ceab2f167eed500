// The device memory that one process may take on one GPU, and who holds how much of it.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <thread>

namespace phi::gpu {

class MemoryBudget {
 public:
  explicit MemoryBudget(std::int64_t bytes) : most_(bytes), bytes_(bytes) {}

  std::int64_t bytes() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return bytes_;
  }

  // Other programs use the GPU, too: from now on so many bytes, but no more than at first.
  void Set(std::int64_t bytes) {
    std::lock_guard<std::mutex> lock(mutex_);
    bytes_ = std::min(bytes, most_);
  }
  bool IsLowered() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return bytes_ < most_;
  }

  // Lets the calls under way end, and no other thread's begin while it lives.
  class Alone {
   public:
    explicit Alone(MemoryBudget* budget) : budget_(budget) {
      std::unique_lock<std::mutex> lock(budget_->mutex_);
      budget_->changed_.wait(lock, [&] { return !budget_->alone_; });
      budget_->alone_ = std::this_thread::get_id();
      budget_->changed_.wait(lock, [&] { return budget_->held_ == 0; });
    }
    ~Alone() {
      {
        std::lock_guard<std::mutex> lock(budget_->mutex_);
        budget_->alone_.reset();
      }
      budget_->changed_.notify_all();
    }
    Alone(const Alone&) = delete;
    Alone& operator=(const Alone&) = delete;

   private:
    MemoryBudget* budget_;
  };

  // A call's share, from its start to its end. Waits while the other calls hold too much; a call alone always starts.
  class Lease {
   public:
    Lease(MemoryBudget* budget, std::int64_t bytes) : budget_(budget), bytes_(bytes) {
      std::unique_lock<std::mutex> lock(budget_->mutex_);
      budget_->changed_.wait(lock, [&] { return budget_->MayStart(bytes_); });
      budget_->held_ += bytes_;
    }
    ~Lease() {
      {
        std::lock_guard<std::mutex> lock(budget_->mutex_);
        budget_->held_ -= bytes_;
      }
      budget_->changed_.notify_all();
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;

   private:
    MemoryBudget* budget_;
    std::int64_t bytes_;
  };

 private:
  bool MayStart(std::int64_t bytes) const {
    if (alone_ && *alone_ != std::this_thread::get_id()) return false;
    return held_ == 0 || held_ + bytes <= bytes_;
  }

  const std::int64_t most_;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::int64_t bytes_, held_ = 0;
  std::optional<std::thread::id> alone_;
};

}  // namespace phi::gpu

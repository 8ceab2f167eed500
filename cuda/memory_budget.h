// The device memory that one process may take on one GPU, and who holds how much of it.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace phi::gpu {

class MemoryBudget {
 public:
  explicit MemoryBudget(std::int64_t bytes) : bytes_(bytes) {}

  std::int64_t bytes() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return bytes_;
  }

  // When an allocation failed although the budget allowed it (other programs use the GPU, too): from now on no more than
  // what the calls under way hold and `free` bytes.
  void Lower(std::int64_t free) {
    std::lock_guard<std::mutex> lock(mutex_);
    bytes_ = std::min(bytes_, held_ + free);
  }

  // A call's share, from its start to its end. Waits while the other calls hold too much; a call alone always starts.
  class Lease {
   public:
    Lease(MemoryBudget* budget, std::int64_t bytes) : budget_(budget), bytes_(bytes) {
      std::unique_lock<std::mutex> lock(budget_->mutex_);
      budget_->changed_.wait(
          lock, [&] { return budget_->held_ == 0 || budget_->held_ + bytes_ <= budget_->bytes_; });
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
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::int64_t bytes_, held_ = 0;
};

}  // namespace phi::gpu

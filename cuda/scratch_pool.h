// Scratch memory and streams for one call at a time, kept between calls.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <limits>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "cuda/error.h"

namespace phi::gpu {

// Lends scratch to concurrent calls; makes a new one when all are lent. Scratch is made of a Task and waits in Settle() for what
// the device has under way with it.
template <typename Scratch>
class ScratchPool {
 public:
  // `most` are lent at once: who comes later waits.
  explicit ScratchPool(std::size_t most = std::numeric_limits<std::size_t>::max()) : most_(most) {}

  class Lease {
   public:
    Lease(ScratchPool* pool, const Task& task) : pool_(pool), scratch_(pool->Take(task)) {}
    // Copies of a call that failed may still be under way: wait for them.
    ~Lease() {
      scratch_->Settle();
      pool_->Return(std::move(scratch_));
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    Scratch* get() const { return scratch_.get(); }
    Scratch* operator->() const { return scratch_.get(); }

   private:
    ScratchPool* pool_;
    std::unique_ptr<Scratch> scratch_;
  };

  // Frees what is not lent.
  void FreeIdle() {
    std::lock_guard<std::mutex> lock(mutex_);
    idle_.clear();
  }

  template <typename Function>
  void ForEachIdle(const Function& function) {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const std::unique_ptr<Scratch>& idle : idle_) function(idle.get());
  }

 private:
  std::unique_ptr<Scratch> Take(const Task& task) {
    std::unique_lock<std::mutex> lock(mutex_);
    returned_.wait(lock, [&] { return num_lent_ < most_; });
    std::unique_ptr<Scratch> scratch;
    if (idle_.empty()) {
      scratch = std::make_unique<Scratch>(task);
    } else {
      scratch = std::move(idle_.back());
      idle_.pop_back();
    }
    ++num_lent_;
    return scratch;
  }

  void Return(std::unique_ptr<Scratch> scratch) {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      --num_lent_;
      idle_.push_back(std::move(scratch));
    }
    returned_.notify_one();
  }

  const std::size_t most_;
  std::mutex mutex_;
  std::condition_variable returned_;
  std::size_t num_lent_ = 0;
  std::vector<std::unique_ptr<Scratch>> idle_;
};

}  // namespace phi::gpu

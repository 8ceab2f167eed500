// Cooperative cancellation: a signal handler sets the flag, long loops look at it between units of work.
#pragma once

#include <atomic>
#include <stdexcept>

namespace phi {

struct Cancelled : std::runtime_error {
  Cancelled() : std::runtime_error("cancelled") {}
};

// Async-signal-safe: a lock-free atomic store.
inline std::atomic<bool>& CancellationFlag() {
  static std::atomic<bool> flag{false};
  return flag;
}

inline void ThrowIfCancelled() {
  if (CancellationFlag().load(std::memory_order_relaxed)) throw Cancelled();
}

}  // namespace phi

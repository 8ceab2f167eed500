// Device copies of host images and maps, made once and kept while the work at hand comes back to them.
//
// The key is the identity of a shared host object. The cache holds it weakly: an address that the host has freed and
// given to another object is never mistaken for the old one.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <list>
#include <memory>
#include <mutex>

#include "cuda/stream.h"

namespace phi::gpu {

// Safe for concurrent use. A handle keeps its copy alive after eviction.
template <typename Host, typename Device>
class DeviceCache {
 public:
  using Upload = std::function<std::shared_ptr<const Device>(const Host&, cudaStream_t)>;

  explicit DeviceCache(Upload upload) : upload_(std::move(upload)) {}

  // The copy of `host`; work that `stream` gets from now on sees it complete.
  std::shared_ptr<const Device> Get(const std::shared_ptr<const Host>& host, cudaStream_t stream,
                                    const Task& task) {
    std::lock_guard<std::mutex> lock(mutex_);
    entries_.remove_if([](const Entry& e) { return e.host.expired(); });
    for (auto it = entries_.begin(); it != entries_.end(); ++it) {
      if (it->host.lock() != host) continue;
      entries_.splice(entries_.begin(), entries_, it);  // most recently used first
      it->uploaded.Delay(stream, task);
      return it->device;
    }
    std::shared_ptr<const Device> device = upload_(*host, stream);
    Event uploaded(Event::Timing::kOff, task);
    uploaded.Record(stream, task);
    entries_.push_front({host, device, std::move(uploaded)});
    Trim();
    return device;
  }

  // From now on keeps the `num_entries` that were used last: as many as the kind of call at hand comes back to. Calls
  // under way keep what they hold.
  void KeepAtMost(std::size_t num_entries) {
    std::lock_guard<std::mutex> lock(mutex_);
    max_entries_ = num_entries;
    Trim();
  }

 private:
  struct Entry {
    std::weak_ptr<const Host> host;
    std::shared_ptr<const Device> device;
    Event uploaded;
  };

  void Trim() {
    while (entries_.size() > max_entries_) entries_.pop_back();
  }

  std::size_t max_entries_ = std::numeric_limits<std::size_t>::max();
  const Upload upload_;
  std::mutex mutex_;
  std::list<Entry> entries_;
};

}  // namespace phi::gpu

// Device copies of host images and maps, made once and kept while the work at hand comes back to them.
//
// The key is the identity of a shared host object. The cache holds it weakly: an address that the host has freed and
// given to another object is never mistaken for the old one.
//
// To free device memory, CUDA waits for all kernels on the device. So a copy that nobody needs any more hands its memory on to the
// next one instead. To upload takes milliseconds: other threads find their copies meanwhile.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "cuda/error.h"

namespace phi::gpu {

// Safe for concurrent use. A handle keeps its copy, also after eviction. Whoever lets go of it has waited for the work on the device
// that reads the copy: its memory may be another's at once.
template <typename Host, typename Device>
class DeviceCache {
 public:
  // Makes `copy`, new or once another's, the host object's. Returns once it is complete.
  using Upload = std::function<void(const Host&, cudaStream_t, Device* copy)>;

  explicit DeviceCache(Upload upload) : upload_(std::move(upload)) {}

  // The copy of `host`, complete. Uploaded where it is not there, on `stream` or one that Upload has.
  std::shared_ptr<const Device> Get(const std::shared_ptr<const Host>& host, cudaStream_t stream) {
    return GetOrMake(host, [&](Device* copy) { upload_(*host, stream, copy); });
  }

  // The same; make(copy) makes it, complete.
  template <typename Make>
  std::shared_ptr<const Device> GetOrMake(const std::shared_ptr<const Host>& host, const Make& make) {
    std::unique_lock<std::mutex> lock(mutex_);
    auto entry = Find(host);
    while (entry != entries_.end() && entry->device == nullptr) {
      uploaded_.wait(lock);
      entry = Find(host);
    }
    if (entry != entries_.end()) {
      entries_.splice(entries_.begin(), entries_, entry);  // most recently used first
      return entry->device;
    }
    std::shared_ptr<Device> device = TakeUnused();
    if (device == nullptr) device = std::make_shared<Device>();
    entry = entries_.insert(entries_.begin(), {host, nullptr});
    lock.unlock();
    try {
      make(device.get());
    } catch (...) {
      lock.lock();
      entries_.erase(entry);
      uploaded_.notify_all();
      throw;
    }
    lock.lock();
    entry->device = device;
    uploaded_.notify_all();
    const std::vector<Entry> evicted = Trim(&lock);
    return device;
  }

  // From now on keeps the `num_entries` that were used last: as many as the kind of call at hand comes back to. Calls
  // under way keep what they hold. A new cache keeps none.
  void KeepAtMost(std::size_t num_entries) {
    std::unique_lock<std::mutex> lock(mutex_);
    max_entries_ = num_entries;
    const std::vector<Entry> evicted = Trim(&lock);
  }

  // The same, and as many as before where that was more.
  void KeepAtLeast(std::size_t num_entries) {
    const std::lock_guard<std::mutex> lock(mutex_);
    max_entries_ = std::max(max_entries_, num_entries);
  }

 private:
  struct Entry {
    std::weak_ptr<const Host> host;
    std::shared_ptr<Device> device;  // null: a thread uploads it
  };
  using Entries = std::list<Entry>;

  typename Entries::iterator Find(const std::shared_ptr<const Host>& host) {
    return std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.host.lock() == host; });
  }

  static bool IsExpired(const Entry& entry) { return entry.device != nullptr && entry.host.expired(); }

  // Where a new entry goes: one whose host object is gone, or, in a full cache, the one that has not been used for longest.
  // What a call holds is not taken from it.
  std::shared_ptr<Device> TakeUnused() {
    auto found = std::find_if(entries_.rbegin(), entries_.rend(),
                              [](const Entry& entry) { return IsExpired(entry) && entry.device.use_count() == 1; });
    if (found == entries_.rend() && entries_.size() >= max_entries_) {
      found = std::find_if(entries_.rbegin(), entries_.rend(), [](const Entry& entry) { return entry.device.use_count() == 1; });
    }
    if (found == entries_.rend()) return nullptr;
    std::shared_ptr<Device> device = std::move(found->device);
    entries_.erase(std::next(found).base());
    return device;
  }

  // Unlocks: what is evicted is freed by the caller, without the lock.
  std::vector<Entry> Trim(std::unique_lock<std::mutex>* lock) {
    std::vector<Entry> evicted;
    const auto evict_from_the_back = [&](const auto& condition) {
      for (auto it = entries_.end(); it != entries_.begin() && entries_.size() > max_entries_;) {
        --it;
        if (!condition(*it)) continue;
        evicted.push_back(std::move(*it));
        it = entries_.erase(it);
      }
    };
    evict_from_the_back(IsExpired);
    evict_from_the_back([](const Entry& entry) { return entry.device != nullptr; });
    lock->unlock();
    return evicted;
  }

  const Upload upload_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable uploaded_;
  std::size_t max_entries_ = 0;
  Entries entries_;
};

}  // namespace phi::gpu

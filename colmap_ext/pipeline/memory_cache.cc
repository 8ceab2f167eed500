#include "colmap_ext/pipeline/memory_cache.h"

#include <algorithm>
#include <exception>

namespace colmap_ext {

MemoryCache::Item MemoryCache::GetOrLoad(Key key, const Loader& load) {
  Lock lock(mutex_);
  for (;;) {
    const auto it = entries_.find(key);
    if (it == entries_.end()) break;
    if (!it->second.loading) {
      recency_.splice(recency_.begin(), recency_, it->second.recency);
      return it->second.sized.item;
    }
    loaded_.wait(lock);
  }
  Entry claim;
  claim.loading = true;
  claim.recency = recency_.insert(recency_.begin(), key);
  entries_[key] = claim;
  lock.unlock();
  Sized sized;
  try {
    sized = load();
  } catch (...) {
    Erase(key);
    loaded_.notify_all();
    throw;
  }
  lock.lock();
  Entry entry;
  entry.sized = sized;
  loaded_.notify_all();  // before others are evicted, which may fail
  Insert(lock, key, std::move(entry));
  return sized.item;
}

MemoryCache::Item MemoryCache::Find(const Key& key) const {
  Lock lock(mutex_);
  const auto it = entries_.find(key);
  return it != entries_.end() ? it->second.sized.item : nullptr;
}

void MemoryCache::Put(Key key, Entry entry) {
  Lock lock(mutex_);
  Insert(lock, key, std::move(entry));
}

void MemoryCache::PutPinned(Key key, Sized item) { Put(std::move(key), {.sized = std::move(item), .pinned = true}); }

void MemoryCache::Unpin(Key key) {
  Lock lock(mutex_);
  const auto it = entries_.find(key);
  if (it == entries_.end()) return;
  it->second.pinned = false;
  EvictToBudget(lock);
}

void MemoryCache::PutTransient(Key key, Sized item, Spill spill) {
  Put(std::move(key), {.sized = std::move(item), .spill = std::move(spill)});
}

void MemoryCache::PutSpare(Key key, Sized item) { Put(std::move(key), {.sized = std::move(item), .spare = true}); }

void MemoryCache::Erase(Key key) {
  Lock lock(mutex_);
  const auto it = entries_.find(key);
  if (it == entries_.end()) return;
  bytes_ -= it->second.sized.num_bytes;
  recency_.erase(it->second.recency);
  entries_.erase(it);
}

void MemoryCache::Insert(Lock& lock, Key key, Entry entry) {
  const auto it = entries_.find(key);
  if (it != entries_.end()) {
    bytes_ -= it->second.sized.num_bytes;
    recency_.erase(it->second.recency);
    entries_.erase(it);
  }
  bytes_ += entry.sized.num_bytes;
  entry.recency = recency_.insert(entry.spare ? recency_.end() : recency_.begin(), key);
  entries_.emplace(key, std::move(entry));
  EvictToBudget(lock);
  peak_bytes_ = std::max(peak_bytes_, bytes_);
}

void MemoryCache::EvictToBudget(Lock& lock) {
  auto candidate = recency_.end();
  while (bytes_ > budget_bytes_ && candidate != recency_.begin()) {
    --candidate;
    const Key key = *candidate;
    Entry& entry = entries_.at(key);
    if (entry.pinned || entry.loading) continue;
    if (entry.spill) {
      // Pinned while the lock is open, so that nobody loads a file that is not there yet.
      const Spill spill = std::move(entry.spill);
      entry.spill = nullptr;
      entry.pinned = true;
      const Item item = entry.sized.item;
      lock.unlock();
      std::exception_ptr failure;
      try {
        spill(item);
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      const auto it = entries_.find(key);
      if (it != entries_.end()) {
        it->second.pinned = false;
        if (failure) it->second.spill = spill;  // it exists nowhere else yet
      }
      if (failure) std::rethrow_exception(failure);
      candidate = recency_.end();  // the list may have changed meanwhile
      continue;
    }
    bytes_ -= entry.sized.num_bytes;
    candidate = recency_.erase(candidate);
    entries_.erase(key);
  }
}

std::int64_t MemoryCache::bytes() const {
  Lock lock(mutex_);
  return bytes_;
}

std::int64_t MemoryCache::peak_bytes() const {
  Lock lock(mutex_);
  return peak_bytes_;
}

}  // namespace colmap_ext

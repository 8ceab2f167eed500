// Images and maps in memory within a byte budget: least recently used out first, loaded again on a miss.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace colmap_ext {

// Thread-safe. Items that callers still hold stay alive after eviction; the budget covers what the cache
// itself holds.
class MemoryCache {
 public:
  using Item = std::shared_ptr<const void>;
  using Key = std::pair<int, std::string>;  // (image, kind of item)
  struct Sized {
    Item item;
    std::int64_t num_bytes = 0;
  };
  using Loader = std::function<Sized()>;
  // Saves an item that exists nowhere else before it is evicted.
  using Spill = std::function<void(const Item&)>;

  explicit MemoryCache(std::int64_t budget_bytes) : budget_bytes_(budget_bytes) {}

  // `load` runs outside the lock and once for callers that ask for the same key at the same time. What it
  // throws reaches its caller; the others try themselves.
  Item GetOrLoad(Key key, const Loader& load);

  // Null where it is not in memory now.
  Item Find(const Key& key) const;

  // A pinned item stays until Unpin (while it waits to be written).
  void PutPinned(Key key, Sized item);
  void Unpin(Key key);
  // An item without a file: `spill` is called, outside the lock, when the budget asks for its place.
  void PutTransient(Key key, Sized item, Spill spill);
  // An item that is of use only where nothing else needs its place: it goes first.
  void PutSpare(Key key, Sized item);
  void Erase(Key key);

  std::int64_t bytes() const;
  std::int64_t peak_bytes() const;

 private:
  struct Entry {
    Sized sized = {};
    Spill spill = {};  // empty once the item is in a file
    bool pinned = false;
    bool spare = false;  // put as such
    bool loading = false;
    std::list<Key>::iterator recency = {};
  };
  using Lock = std::unique_lock<std::mutex>;

  void Put(Key key, Entry entry);
  void Insert(Lock& lock, Key key, Entry entry);
  void EvictToBudget(Lock& lock);

  const std::int64_t budget_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable loaded_;
  std::map<Key, Entry> entries_;
  std::list<Key> recency_;  // front = most recent
  std::int64_t bytes_ = 0, peak_bytes_ = 0;
};

}  // namespace colmap_ext

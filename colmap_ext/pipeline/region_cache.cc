#include "colmap_ext/pipeline/region_cache.h"

#include <algorithm>
#include <cstddef>
#include <exception>

#include <tbb/task_arena.h>

namespace colmap_ext {
namespace {

// An image's sources are asked for again by its neighbours, soon: those of a few images fit.
constexpr std::size_t kMostImages = 64;

}  // namespace

RegionCache::Regions RegionCache::Get(int image, const std::function<phi::ViewRegions()>& find) {
  std::promise<Regions> promise;
  {
    std::unique_lock<std::mutex> lock(mutex_);
    if (const auto found = entries_.find(image); found != entries_.end()) {
      found->second.last_use = ++num_uses_;
      const std::shared_future<Regions> regions = found->second.regions;
      lock.unlock();
      return regions.get();
    }
    if (entries_.size() >= kMostImages) DropOldest();
    entries_[image] = {promise.get_future().share(), ++num_uses_};
  }
  try {
    // A thread that waits within `find` must not begin another Get meanwhile: it might be for what waits for this one.
    Regions regions = tbb::this_task_arena::isolate([&] { return std::make_shared<const phi::ViewRegions>(find()); });
    promise.set_value(regions);
    return regions;
  } catch (...) {
    promise.set_exception(std::current_exception());
    std::lock_guard<std::mutex> lock(mutex_);
    entries_.erase(image);
    throw;
  }
}

void RegionCache::DropOldest() {
  const auto oldest = std::min_element(entries_.begin(), entries_.end(), [](const auto& a, const auto& b) {
    return a.second.last_use < b.second.last_use;
  });
  entries_.erase(oldest);
}

}  // namespace colmap_ext

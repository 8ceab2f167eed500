// What the images' regions tell other images, found once for all that ask.
#pragma once

#include <cstdint>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>

#include "phi/inference/source_regions.h"

namespace colmap_ext {

// Of the images that were asked for last: up to half a megabyte each, whatever their size. Thread-safe.
class RegionCache {
 public:
  using Regions = std::shared_ptr<const phi::ViewRegions>;

  // `find` is called unless they are there, by one thread at a time for an image; the others wait. What it throws reaches all of
  // them, and the next one that asks calls it again.
  Regions Get(int image, const std::function<phi::ViewRegions()>& find);

 private:
  struct Entry {
    std::shared_future<Regions> regions;
    std::uint64_t last_use;
  };

  void DropOldest();

  std::mutex mutex_;
  std::map<int, Entry> entries_;
  std::uint64_t num_uses_ = 0;
};

}  // namespace colmap_ext

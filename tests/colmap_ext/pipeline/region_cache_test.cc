#include "colmap_ext/pipeline/region_cache.h"

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace colmap_ext {
namespace {

phi::ViewRegions WithRegions(std::size_t n) {
  phi::ViewRegions regions;
  regions.regions.resize(n);
  return regions;
}

TEST(RegionCache, AnImagesAreFoundOnceForAllThatAsk) {
  RegionCache cache;
  std::atomic<int> num_calls = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      EXPECT_EQ(cache.Get(3, [&] { return ++num_calls, WithRegions(5); })->regions.size(), 5u);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_calls, 1);
  EXPECT_EQ(cache.Get(4, [] { return WithRegions(2); })->regions.size(), 2u);
}

TEST(RegionCache, AFailureIsToldAndNotKept) {
  RegionCache cache;
  EXPECT_THROW(cache.Get(3, []() -> phi::ViewRegions { throw std::runtime_error("no"); }), std::runtime_error);
  EXPECT_EQ(cache.Get(3, [] { return WithRegions(1); })->regions.size(), 1u);
}

TEST(RegionCache, TheImagesOfLongAgoAreForgotten) {
  RegionCache cache;
  for (int image = 0; image < 70; ++image) {
    cache.Get(image, [] { return WithRegions(1); });
    cache.Get(0, [] { return WithRegions(2); });  // asked for all the time
  }
  EXPECT_EQ(cache.Get(0, [] { return WithRegions(3); })->regions.size(), 1u);
  EXPECT_EQ(cache.Get(69, [] { return WithRegions(3); })->regions.size(), 1u);
  EXPECT_EQ(cache.Get(1, [] { return WithRegions(3); })->regions.size(), 3u);
}

}  // namespace
}  // namespace colmap_ext

#include "colmap_ext/pipeline/memory_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace colmap_ext {
namespace {

MemoryCache::Sized MakeItem(int value, std::int64_t num_bytes) {
  return {std::make_shared<const int>(value), num_bytes};
}
int Value(const MemoryCache::Item& item) { return *static_cast<const int*>(item.get()); }

TEST(MemoryCacheTest, LoadsOnceAndDropsTheLeastRecentlyUsed) {
  MemoryCache cache(20);
  int num_loads = 0;
  const auto get = [&](int image) {
    return Value(cache.GetOrLoad({image, "gray"}, [&] {
      ++num_loads;
      return MakeItem(image, 10);
    }));
  };
  EXPECT_EQ(get(1), 1);
  EXPECT_EQ(get(2), 2);
  EXPECT_EQ(get(1), 1);
  EXPECT_EQ(num_loads, 2);
  EXPECT_EQ(get(3), 3);  // drops 2, which was used before 1
  EXPECT_EQ(cache.bytes(), 20);
  get(1);
  EXPECT_EQ(num_loads, 3);
  get(2);
  EXPECT_EQ(num_loads, 4);
}

TEST(MemoryCacheTest, PinnedItemsStayUntilTheyAreWritten) {
  MemoryCache cache(5);
  cache.PutPinned({1, "map"}, MakeItem(1, 10));
  EXPECT_EQ(cache.bytes(), 10);
  EXPECT_EQ(
      Value(cache.GetOrLoad({1, "map"}, []() -> MemoryCache::Sized { throw std::logic_error("not there"); })),
      1);
  cache.Unpin({1, "map"});
  EXPECT_EQ(cache.bytes(), 0);
}

TEST(MemoryCacheTest, TransientItemsAreSavedBeforeTheyGo) {
  MemoryCache cache(10);
  std::vector<int> saved;
  const auto save = [&](const MemoryCache::Item& item) { saved.push_back(Value(item)); };
  cache.PutTransient({1, "inferred"}, MakeItem(1, 8), save);
  EXPECT_TRUE(saved.empty());
  cache.PutTransient({2, "inferred"}, MakeItem(2, 8), save);
  EXPECT_EQ(saved, std::vector<int>{1});
  EXPECT_EQ(cache.bytes(), 8);
  // Once it is in a file, an item that came back is not saved again.
  cache.GetOrLoad({1, "inferred"}, [] { return MakeItem(1, 8); });
  EXPECT_EQ(saved, (std::vector<int>{1, 2}));
  cache.GetOrLoad({2, "inferred"}, [] { return MakeItem(2, 8); });
  EXPECT_EQ(saved, (std::vector<int>{1, 2}));
}

TEST(MemoryCacheTest, SpareItemsGoFirst) {
  MemoryCache cache(20);
  cache.PutPinned({1, "map"}, MakeItem(1, 10));
  cache.Unpin({1, "map"});
  cache.PutSpare({1, "photo"}, MakeItem(2, 10));
  ASSERT_NE(cache.Find({1, "photo"}), nullptr);
  cache.PutPinned({2, "map"}, MakeItem(3, 10));
  EXPECT_EQ(cache.Find({1, "photo"}), nullptr) << "although the map is older";
  EXPECT_NE(cache.Find({1, "map"}), nullptr);
  cache.PutSpare({1, "photo"}, MakeItem(2, 10));
  EXPECT_EQ(cache.Find({1, "photo"}), nullptr) << "there is no place for it";
  EXPECT_EQ(cache.bytes(), 20);
}

TEST(MemoryCacheTest, FailedLoadReachesItsCallerAndIsTriedAgain) {
  MemoryCache cache(10);
  EXPECT_THROW(
      cache.GetOrLoad({1, "gray"}, []() -> MemoryCache::Sized { throw std::runtime_error("damaged"); }),
      std::runtime_error);
  EXPECT_EQ(Value(cache.GetOrLoad({1, "gray"}, [] { return MakeItem(7, 1); })), 7);
}

// A full disk: what was loaded evicts an item that cannot be saved. Whoever waits for the same item must wake up.
TEST(MemoryCacheTest, FailedSpillWakesTheWaitersAndLosesNothing) {
  struct Shared {
    MemoryCache cache{10};
    std::atomic<bool> loading{false}, full{true};
    std::atomic<int> num_saved{0};
  };
  const auto shared = std::make_shared<Shared>();  // outlives this test where a thread hangs
  shared->cache.PutTransient({1, "inferred"}, MakeItem(1, 8), [&shared = *shared](const MemoryCache::Item&) {
    if (shared.full) throw std::runtime_error("disk full");
    ++shared.num_saved;
  });
  const auto get = [shared] {
    return Value(shared->cache.GetOrLoad({2, "inferred"}, [&] {
      shared->loading = true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      return MakeItem(2, 8);
    }));
  };
  std::promise<int> promise;
  std::future<int> waited = promise.get_future();
  std::thread waiter([shared, get, promise = std::move(promise)]() mutable {
    while (!shared->loading) std::this_thread::yield();
    try {
      promise.set_value(get());
    } catch (...) {
      promise.set_exception(std::current_exception());
    }
  });
  EXPECT_THROW(get(), std::runtime_error);
  if (waited.wait_for(std::chrono::seconds(5)) != std::future_status::ready) {
    waiter.detach();
    FAIL() << "the waiter still waits";
  }
  waiter.join();
  EXPECT_EQ(waited.get(), 2);
  // Once there is space, the item that could not be saved is saved before it goes.
  shared->full = false;
  shared->cache.GetOrLoad({3, "inferred"}, [] { return MakeItem(3, 8); });
  EXPECT_EQ(shared->num_saved, 1);
}

TEST(MemoryCacheTest, SimultaneousCallersShareALoad) {
  MemoryCache cache(100);
  std::atomic<int> num_loads{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      const auto item = cache.GetOrLoad({1, "gray"}, [&] {
        ++num_loads;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        return MakeItem(5, 1);
      });
      EXPECT_EQ(Value(item), 5);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_loads, 1);
}

}  // namespace
}  // namespace colmap_ext

#include "colmap_ext/write_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <latch>
#include <numeric>
#include <thread>
#include <vector>

#include "phi/base/error.h"
#include "tests/support/error_message.h"

namespace colmap_ext {
namespace {

using test_support::MessageOf;

TEST(WriteQueue, WritesRunInTheirOrderAndAreDoneWhenItIsFinished) {
  std::vector<int> written, wanted(1000);
  std::iota(wanted.begin(), wanted.end(), 0);
  WriteQueue queue(64);
  for (const int i : wanted) queue.Add(8, [&written, i] { written.push_back(i); });
  queue.Finish();
  EXPECT_EQ(written, wanted);
  std::latch has_begun(1);
  queue.Add(8, [&] {
    has_begun.count_down();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    written.clear();
  });
  has_begun.wait();
  queue.Finish();
  EXPECT_TRUE(written.empty());
}

TEST(WriteQueue, WhoAddsWaitsWhileMoreThanItHoldsIsToBeWritten) {
  std::latch may_write(1);
  std::future<void> third;  // ends after the queue
  WriteQueue queue(10);
  queue.Add(6, [&] { may_write.wait(); });
  queue.Add(6, [] {});
  third = std::async(std::launch::async, [&] { queue.Add(6, [] {}); });
  EXPECT_EQ(third.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  may_write.count_down();
  third.get();
  queue.Finish();
}

TEST(WriteQueue, AWriteThatFailsIsTheLastAndIsToldOfFromThenOn) {
  std::latch may_fail(1);
  std::atomic<bool> goes_on = false;
  WriteQueue queue(10);
  queue.Add(6, [&] {
    may_fail.wait();
    throw phi::ResourceError("the disk is full");
  });
  queue.Add(6, [&] { goes_on = true; });
  may_fail.count_down();
  // There is no room until the first is done.
  EXPECT_EQ(MessageOf<phi::ResourceError>([&] { queue.Add(6, [&] { goes_on = true; }); }), "the disk is full");
  EXPECT_EQ(MessageOf<phi::ResourceError>([&] { queue.Finish(); }), "the disk is full");
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // in which the next would run
  EXPECT_FALSE(goes_on);
}

}  // namespace
}  // namespace colmap_ext

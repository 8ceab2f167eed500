#include "colmap_ext/pipeline/task_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <numeric>
#include <set>

#include "colmap_ext/pipeline/writer_pool.h"
#include "phi/base/cancellation.h"
#include "phi/base/device_error.h"
#include "phi/working_backends.h"
#include "tests/support/fake_backend.h"
#include "tests/support/log_capture.h"

namespace colmap_ext {
namespace {

using Backends = std::vector<std::unique_ptr<phi::Backend>>;

// Of one kind, waiting for nothing.
std::vector<QueuedTask> Independent(int count) { return std::vector<QueuedTask>(static_cast<std::size_t>(count)); }

class TaskQueueTest : public ::testing::Test {
 protected:
  Backends MakeBackends(int count, int num_concurrent) {
    return test_support::MakeFakeBackends(&calls_, count, num_concurrent);
  }
  void TearDown() override { phi::CancellationFlag() = false; }

  test_support::FakeCalls calls_;
};

TEST_F(TaskQueueTest, RunsEachTaskOnceAndUsesEveryBackend) {
  std::vector<std::atomic<int>> count(100);
  std::mutex mutex;
  std::set<const phi::Backend*> used;
  const auto backends = MakeBackends(3, 2);
  const auto outcome = RunTasks(Independent(100), backends, [&](int task, phi::Backend& backend) {
    ++count[task];
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::lock_guard<std::mutex> lock(mutex);
    used.insert(&backend);
  });
  EXPECT_TRUE(outcome.failures.empty());
  for (const auto& c : count) EXPECT_EQ(c, 1);
  EXPECT_EQ(used.size(), 3u);
}

TEST_F(TaskQueueTest, BadInputFailsItsTaskAlone) {
  std::atomic<int> num_run{0};
  const auto failures = RunTasks(Independent(4), MakeBackends(2, 1), [&](int task, phi::Backend&) {
    ++num_run;
    if (task % 2 == 1) throw phi::InputError("image " + std::to_string(task));
  }).failures;
  EXPECT_EQ(num_run, 4);
  ASSERT_EQ(failures.size(), 2u);
  EXPECT_EQ(failures[0].task, 1);
  EXPECT_EQ(failures[1].message.text, "image 3");
}

TEST_F(TaskQueueTest, OtherErrorsAndCancellationStopTheQueue) {
  std::atomic<int> num_run{0};
  const std::vector<QueuedTask> tasks = Independent(50);
  EXPECT_THROW(RunTasks(tasks, MakeBackends(1, 1),
                        [&](int, phi::Backend&) {
                          if (++num_run == 3) throw phi::ResourceError("device lost");
                        }),
               phi::ResourceError);
  EXPECT_EQ(num_run, 3);
  num_run = 0;
  EXPECT_THROW(RunTasks(tasks, MakeBackends(1, 1),
                        [&](int, phi::Backend&) {
                          if (++num_run == 4) phi::CancellationFlag() = true;
                        }),
               phi::Cancelled);
  EXPECT_EQ(num_run, 4);
}

// The last image is on the failing device when the other one has nothing left to do.
TEST_F(TaskQueueTest, ImagesOfAFailedDeviceAreDoneByTheOthers) {
  const test_support::LogCapture log;
  const auto backends = MakeBackends(2, 2);
  std::vector<std::atomic<int>> num_done(20);
  std::atomic<int> num_lost{0};
  const auto outcome = RunTasks(Independent(20), backends, [&](int task, phi::Backend& backend) {
    if (&backend == backends[1].get()) {
      ++num_lost;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      throw phi::DeviceError("illegal memory access");
    }
    while (num_lost == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ++num_done[task];
  });
  EXPECT_TRUE(outcome.failures.empty());
  for (const auto& count : num_done) EXPECT_EQ(count, 1);
  EXPECT_LE(num_lost, 2);  // one for each worker
  EXPECT_THAT(log.messages(), testing::ElementsAre(testing::HasSubstr("illegal memory access")));
}

TEST_F(TaskQueueTest, TheLastDevicesFailureEndsTheQueue) {
  const test_support::LogCapture log;
  std::atomic<int> num_run{0};
  EXPECT_THROW(RunTasks(Independent(50), MakeBackends(3, 1),
                        [&](int, phi::Backend&) {
                          ++num_run;
                          throw phi::DeviceError("device lost");
                        }),
               phi::DeviceError);
  EXPECT_EQ(num_run, 3);
}

// Of two kinds: task 2 j makes what task 2 k + 1 reads where j is k or the one beside it.
std::vector<QueuedTask> Chain(int count) {
  std::vector<QueuedTask> tasks;
  for (int k = 0; k < count; ++k) {
    tasks.push_back({.kind = 0, .needs = {}});
    tasks.push_back({.kind = 1, .needs = {2 * k}});
    if (k > 0) tasks.back().needs.push_back(2 * k - 2);
  }
  return tasks;
}

TEST_F(TaskQueueTest, ATaskBeginsOnceWhatItNeedsIsThereAndTheOthersDoNotWait) {
  const std::vector<QueuedTask> tasks = Chain(20);
  std::vector<std::atomic<bool>> done(tasks.size());
  std::atomic<int> num_early{0}, num_before_the_last{0};
  RunTasks(tasks, MakeBackends(2, 2), [&](int task, phi::Backend&) {
    for (const int needed : tasks[task].needs) num_early += !done[needed];
    num_before_the_last += tasks[task].kind == 1 && !done[38];
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    done[task] = true;
  });
  EXPECT_EQ(num_early, 0);
  EXPECT_GT(num_before_the_last, 0);
  for (const auto& d : done) EXPECT_TRUE(d);
}

TEST_F(TaskQueueTest, ABackendThatDoesOneImageAtATimeEndsItBeforeTheNext) {
  std::vector<int> order;
  RunTasks(Chain(3), MakeBackends(1, 1), [&](int task, phi::Backend&) { order.push_back(task); });
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3, 4, 5}));
}

TEST_F(TaskQueueTest, ADeviceDoesNoMoreOfAKindAtOnceThanItAskedFor) {
  std::mutex mutex;
  int running[2] = {0, 0}, most[2] = {0, 0}, most_in_all = 0;
  const std::vector<QueuedTask> tasks = Chain(30);
  RunTasks(tasks, MakeBackends(1, 2), [&](int task, phi::Backend&) {
    const int kind = tasks[task].kind;
    {
      std::lock_guard<std::mutex> lock(mutex);
      most[kind] = std::max(most[kind], ++running[kind]);
      most_in_all = std::max(most_in_all, running[0] + running[1]);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    std::lock_guard<std::mutex> lock(mutex);
    --running[kind];
  });
  EXPECT_EQ(most[0], 2);
  EXPECT_LE(most[1], 2);
  EXPECT_GT(most_in_all, 2);
}

// Of three kinds that wait for nothing, so many of each: how many of each kind are among the first that eight workers take.
std::vector<int> KindsBegunFirst(const std::vector<int>& counts, const Backends& backends) {
  constexpr int kNumWorkers = 8;
  std::vector<QueuedTask> tasks;
  for (int kind = 0; kind < std::ssize(counts); ++kind) {
    for (int i = 0; i < counts[kind]; ++i) tasks.push_back({.kind = kind, .needs = {}});
  }
  std::vector<int> begun(counts.size(), 0);
  std::mutex mutex;
  std::condition_variable changed;
  int num_begun = 0;
  RunTasks(tasks, backends, [&](int task, phi::Backend&) {
    std::unique_lock<std::mutex> lock(mutex);
    if (++num_begun <= kNumWorkers) ++begun[tasks[task].kind];
    changed.notify_all();
    EXPECT_TRUE(changed.wait_for(lock, std::chrono::seconds(30), [&] { return num_begun >= kNumWorkers; }));
  });
  return begun;
}

// Else the device would be idle while later kinds are on the host.
TEST_F(TaskQueueTest, TwoCallsGoAheadWhileFewTasksWait) {
  EXPECT_THAT(KindsBegunFirst({8, 8, 4}, MakeBackends(1, 4)), testing::ElementsAre(2, 2, 4));
  EXPECT_THAT(KindsBegunFirst({8, 30, 4}, MakeBackends(1, 4)), testing::ElementsAre(0, 4, 4));
}

TEST_F(TaskQueueTest, WhatNeedsAFailedTaskIsLeftOut) {
  std::vector<std::atomic<int>> num_run(10);
  // 0 fails; 3 needs it through 2.
  const std::vector<QueuedTask> tasks = {{.kind = 0, .needs = {}}, {.kind = 0, .needs = {}},  {.kind = 1, .needs = {0, 1}},
                                         {.kind = 2, .needs = {2}}, {.kind = 1, .needs = {1}}};
  const QueueOutcome outcome = RunTasks(tasks, MakeBackends(1, 2), [&](int task, phi::Backend&) {
    ++num_run[task];
    if (task == 0) throw phi::InputError("no photo");
  });
  ASSERT_EQ(outcome.failures.size(), 1u);
  EXPECT_EQ(outcome.failures[0].task, 0);
  EXPECT_FALSE(outcome.failures[0].is_too_large);
  EXPECT_EQ(outcome.left_out, (std::vector<int>{2, 3}));
  EXPECT_EQ(num_run[1] + num_run[4], 2);
  EXPECT_EQ(num_run[2] + num_run[3], 0);
}

TEST_F(TaskQueueTest, WhatIsTooLargeForADeviceIsDoneByAnother) {
  const auto backends = MakeBackends(2, 1);
  std::atomic<int> num_refused = 0, num_done = 0;
  const auto outcome = RunTasks(Independent(40), backends, [&](int task, phi::Backend& backend) {
    if (task % 4 == 0 && &backend == backends[0].get()) {
      ++num_refused;
      throw phi::TooLargeForDevice("too large");
    }
    ++num_done;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  EXPECT_TRUE(outcome.failures.empty());
  EXPECT_EQ(num_done, 40);
  EXPECT_LE(num_refused, 10) << "no task is offered twice";
}

TEST_F(TaskQueueTest, WhatIsTooLargeForAllFailsAlone) {
  const std::vector<QueuedTask> tasks = Chain(4);
  const auto outcome = RunTasks(tasks, MakeBackends(2, 2), [&](int task, phi::Backend&) {
    if (task == 0) throw phi::TooLargeForDevice("image 'a' is too large");
  });
  ASSERT_EQ(outcome.failures.size(), 1u);
  EXPECT_EQ(outcome.failures[0].task, 0);
  EXPECT_EQ(outcome.failures[0].message.text, "image 'a' is too large");
  EXPECT_TRUE(outcome.failures[0].is_too_large);
  EXPECT_EQ(outcome.left_out, (std::vector<int>{1, 3})) << "what needs it";
}

// The one that could have done it.
TEST_F(TaskQueueTest, ARefusedTaskFailsWithTheLastOtherDevice) {
  const auto backends = MakeBackends(2, 1);
  std::atomic<bool> is_refused = false;
  const auto outcome = RunTasks(Independent(3), backends, [&](int task, phi::Backend& backend) {
    if (&backend == backends[1].get()) {
      while (task != 1 && !is_refused) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      throw phi::DeviceError("lost");
    }
    if (task != 1) return;
    is_refused = true;
    throw phi::TooLargeForDevice("too large");
  });
  ASSERT_EQ(outcome.failures.size(), 1u);
  EXPECT_EQ(outcome.failures[0].task, 1);
}

TEST(WorkingBackendsTest, ABadDeviceIsLeftOutAndNoneCountsTwice) {
  const test_support::LogCapture log;
  test_support::FakeCalls calls;
  std::vector<int> made;
  const auto make = [&](int index) -> std::unique_ptr<phi::Backend> {
    made.push_back(index);
    if (index == 1) throw phi::DeviceError("out of memory");
    return std::make_unique<test_support::FakeBackend>(&calls, 1);
  };
  EXPECT_EQ(phi::MakeWorkingBackends({2, 0, 1, 0, 2}, make).size(), 2u);
  EXPECT_EQ(made, (std::vector<int>{2, 0, 1}));
  EXPECT_THAT(log.messages(), testing::ElementsAre(testing::HasSubstr("GPU 1 is left out: out of memory")));
  EXPECT_THROW(phi::MakeWorkingBackends({1}, make), phi::DeviceError);
}

// In a process of its own, as another user where root would ignore the limit. 10: as expected.
int StartThreadsAtTheLimit(const std::function<void()>& start) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (::geteuid() == 0 && ::setuid(65534) != 0) ::_exit(1);
    const rlimit limit = {1, 1};
    ::setrlimit(RLIMIT_NPROC, &limit);
    try {
      start();
      ::_exit(2);
    } catch (const phi::ResourceError& error) {
      ::_exit(std::string(error.what()).find("ulimit -u") != std::string::npos ? 10 : 3);
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST_F(TaskQueueTest, ThreadsThatCannotStartAreAnErrorAndNoAbort) {
  EXPECT_EQ(StartThreadsAtTheLimit([] { WriterPool pool(4); }), 10);
  const auto backends = MakeBackends(2, 2);
  EXPECT_EQ(StartThreadsAtTheLimit([&] { RunTasks(Independent(3), backends, [](int, phi::Backend&) {}); }), 10);
}

TEST(WriterPoolTest, WritesEverythingAndCounts) {
  WriterPool pool(3);
  std::atomic<int> num_written{0};
  for (int i = 0; i < 40; ++i) {
    pool.Submit([&] {
      ++num_written;
      return std::int64_t{10};
    });
  }
  pool.Drain();
  EXPECT_EQ(num_written, 40);
  EXPECT_EQ(pool.bytes_written(), 400);
}

TEST(WriterPoolTest, FullQueueHoldsTheProducerBack) {
  std::atomic<bool> go{false};
  std::atomic<int> num_submitted{0};
  WriterPool pool(1);
  std::thread producer([&] {
    for (int i = 0; i < 5; ++i) {
      pool.Submit([&] {
        while (!go) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return std::int64_t{0};
      });
      ++num_submitted;
    }
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_LE(num_submitted, 2);  // one is being written, one waits
  go = true;
  producer.join();
  pool.Drain();
  EXPECT_EQ(num_submitted, 5);
}

TEST(WriterPoolTest, FailureToWriteIsNoImagesFault) {
  WriterPool pool(1);
  pool.Submit([]() -> std::int64_t { throw phi::InputError("cannot write x.bin"); });
  EXPECT_THROW(pool.Drain(), phi::ResourceError);
  EXPECT_THROW(pool.Submit([] { return std::int64_t{0}; }), phi::ResourceError);
}

}  // namespace
}  // namespace colmap_ext

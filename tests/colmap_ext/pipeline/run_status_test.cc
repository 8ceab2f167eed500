#include "colmap_ext/pipeline/run_status.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "phi/base/error.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

RunStatus HalfDone() {
  RunStatus status;
  status.num_images = 2;
  status.stages = {{.name = "photometric", .num_done = 1, .num_waiting = 1}};
  status.seconds_left = 60;
  return status;
}

TEST(StatusText, SaysHowToGoOnWhereNobodyIsAtWork) {
  EXPECT_THAT(StatusText(HalfDone(), LockUse::kFree),
              AllOf(HasSubstr("no run is at work on this computer; the same command goes on"), Not(HasSubstr("time left"))));
  EXPECT_THAT(StatusText(HalfDone(), LockUse::kHeld),
              AllOf(HasSubstr("a run is at work on this computer"), HasSubstr("time left: about")));
  EXPECT_THAT(StatusText(HalfDone(), LockUse::kUnknown), HasSubstr("cannot be told"));
}

// The lock of a shard is seen on its own computer alone.
TEST(StatusText, ShardsMayBeAtWorkElsewhere) {
  RunStatus status = HalfDone();
  status.open_shards = {"3/8"};
  EXPECT_THAT(StatusText(status, LockUse::kFree),
              AllOf(HasSubstr("shards at work on other computers, or killed and not started again: 3/8\n"),
                    HasSubstr("time left: about"), Not(HasSubstr("the same command"))));
  EXPECT_THAT(StatusText(status, LockUse::kHeld),
              AllOf(HasSubstr("shards at work, or killed and not started again: 3/8\n"), HasSubstr("a run is at work")));
}

TEST(WorkspaceLock, IsSeenWhileItIsHeld) {
  const test_support::TemporaryFolder folder;
  for (const auto sharing : {WorkspaceLock::Sharing::kAlone, WorkspaceLock::Sharing::kWithShards}) {
    EXPECT_EQ(FindLockUse(folder.path()), LockUse::kFree);
    const WorkspaceLock lock(folder.path(), sharing);
    EXPECT_EQ(FindLockUse(folder.path()), LockUse::kHeld);
  }
  EXPECT_EQ(FindLockUse(folder / "none"), LockUse::kUnknown);
}

// As FindLockUse of another process would, for a moment.
TEST(WorkspaceLock, WaitsForWhoOnlyLooks) {
  const test_support::TemporaryFolder folder;
  const int other = open(folder.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_EQ(flock(other, LOCK_EX), 0);
  std::thread looks([other] {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    close(other);
  });
  EXPECT_NO_THROW(WorkspaceLock{folder.path()});
  looks.join();
}

}  // namespace
}  // namespace colmap_ext

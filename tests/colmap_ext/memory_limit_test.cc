#include "colmap_ext/memory_limit.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

// A machine's proc/ and sys/, as far as they tell of control groups.
class MemoryLimit : public ::testing::Test {
 protected:
  void SetGroups(const std::string& lines) { test_support::WriteBytes(root_ / "proc/self/cgroup", lines); }
  void SetLimit(const std::string& file, const std::string& limit) {
    test_support::WriteBytes(root_ / "sys/fs/cgroup" / file, limit + "\n");
  }
  std::int64_t Limit() const { return ControlGroupMemoryLimit(root_.path()).value_or(-1); }

  test_support::TemporaryFolder root_;
};

TEST_F(MemoryLimit, IsNoneWhereNothingTellsOfGroups) { EXPECT_EQ(Limit(), -1); }

// As Slurm sets it: for the job, below groups without a limit.
TEST_F(MemoryLimit, IsThatOfAnyGroupUpToTheRoot) {
  SetGroups("0::/system.slice/slurmstepd.scope/job_7/step_0/user/task_0\n");
  SetLimit("system.slice/slurmstepd.scope/job_7/step_0/user/task_0/memory.max", "max");
  SetLimit("system.slice/slurmstepd.scope/job_7/memory.max", "8000000000");
  SetLimit("system.slice/memory.max", "9000000000");
  SetLimit("system.slice/slurmstepd.scope/job_8/memory.max", "5");  // another's
  EXPECT_EQ(Limit(), 8000000000);
  SetLimit("system.slice/memory.max", "7000000000");
  EXPECT_EQ(Limit(), 7000000000);
}

// Both versions at once, and colons in a name.
TEST_F(MemoryLimit, IsFoundInVersionOne) {
  SetGroups("5:devices:/other\n4:hugetlb,memory:/slurm/uid:0/job_7\n1:name=systemd:/\n0::/\n");
  SetLimit("memory/slurm/uid:0/job_7/memory.limit_in_bytes", "6000000000");
  SetLimit("memory/slurm/memory.limit_in_bytes", "9223372036854771712");  // none
  SetLimit("memory/other/memory.limit_in_bytes", "5");
  EXPECT_EQ(Limit(), 6000000000);
}

// A container sees its own group as the root, and may be told the host's path.
TEST_F(MemoryLimit, IsTheRootsInAContainer) {
  SetGroups("4:memory:/docker/0123\n0::/../../outside\n");
  SetLimit("memory/memory.limit_in_bytes", "6000000000");
  test_support::WriteBytes(root_ / "sys/outside/memory.max", "5\n");
  EXPECT_EQ(Limit(), 6000000000);
  SetLimit("memory.max", "4000000000");
  EXPECT_EQ(Limit(), 4000000000);
  SetGroups("");
  EXPECT_EQ(Limit(), 4000000000);
}

}  // namespace
}  // namespace colmap_ext

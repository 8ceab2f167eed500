#include "colmap_ext/memory_limit.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "tests/support/control_group_files.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

class MemoryLimit : public ::testing::Test {
 protected:
  std::int64_t Limit() const { return ControlGroupMemoryLimit(files_.root()).value_or(-1); }

  test_support::ControlGroupFiles files_;
};

TEST_F(MemoryLimit, IsNoneWhereNothingTellsOfGroups) { EXPECT_EQ(Limit(), -1); }

// As Slurm sets it: for the job, below groups without a limit.
TEST_F(MemoryLimit, IsThatOfAnyGroupUpToTheRoot) {
  files_.SetGroups("0::/system.slice/slurmstepd.scope/job_7/step_0/user/task_0\n");
  files_.Set("system.slice/slurmstepd.scope/job_7/step_0/user/task_0/memory.max", "max");
  files_.Set("system.slice/slurmstepd.scope/job_7/memory.max", "8000000000");
  files_.Set("system.slice/memory.max", "9000000000");
  files_.Set("system.slice/slurmstepd.scope/job_8/memory.max", "5");  // another's
  EXPECT_EQ(Limit(), 8000000000);
  files_.Set("system.slice/memory.max", "7000000000");
  EXPECT_EQ(Limit(), 7000000000);
}

// Both versions at once, and colons in a name.
TEST_F(MemoryLimit, IsFoundInVersionOne) {
  files_.SetGroups("5:devices:/other\n4:hugetlb,memory:/slurm/uid:0/job_7\n1:name=systemd:/\n0::/\n");
  files_.Set("memory/slurm/uid:0/job_7/memory.limit_in_bytes", "6000000000");
  files_.Set("memory/slurm/memory.limit_in_bytes", "9223372036854771712");  // none
  files_.Set("memory/other/memory.limit_in_bytes", "5");
  EXPECT_EQ(Limit(), 6000000000);
}

// A container sees its own group as the root, and may be told the host's path.
TEST_F(MemoryLimit, IsTheRootsInAContainer) {
  files_.SetGroups("4:memory:/docker/0123\n0::/../../outside\n");
  files_.Set("memory/memory.limit_in_bytes", "6000000000");
  test_support::WriteBytes(files_.root() / "sys/outside/memory.max", "5\n");
  EXPECT_EQ(Limit(), 6000000000);
  files_.Set("memory.max", "4000000000");
  EXPECT_EQ(Limit(), 4000000000);
  files_.SetGroups("");
  EXPECT_EQ(Limit(), 4000000000);
}

}  // namespace
}  // namespace colmap_ext

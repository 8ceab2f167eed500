#include "colmap_ext/processor_limit.h"

#include <sched.h>

#include <gtest/gtest.h>

#include <string>

#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

// A machine's proc/ and sys/, as far as they tell of control groups.
class ProcessorLimit : public ::testing::Test {
 protected:
  void SetGroups(const std::string& lines) { test_support::WriteBytes(root_ / "proc/self/cgroup", lines); }
  void Set(const std::string& file, const std::string& line) {
    test_support::WriteBytes(root_ / "sys/fs/cgroup" / file, line + "\n");
  }
  double Limit() const { return ControlGroupProcessorLimit(root_.path()).value_or(-1); }

  test_support::TemporaryFolder root_;
};

TEST_F(ProcessorLimit, IsNoneWhereNothingTellsOfGroups) { EXPECT_EQ(Limit(), -1); }

// As a container with `--cpus 2.5` has it, below a pod with more.
TEST_F(ProcessorLimit, IsTheLeastUpToTheRoot) {
  SetGroups("0::/kubepods/pod1/container\n");
  Set("kubepods/pod1/container/cpu.max", "max 100000");
  EXPECT_EQ(Limit(), -1);
  Set("kubepods/pod1/cpu.max", "250000 100000");
  EXPECT_EQ(Limit(), 2.5);
  Set("kubepods/pod2/cpu.max", "1000 100000");  // another's
  EXPECT_EQ(Limit(), 2.5);
  Set("cpu.max", "800000 200000");
  EXPECT_EQ(Limit(), 2.5);
  Set("cpu.max", "100000 50000");
  EXPECT_EQ(Limit(), 2);
}

TEST_F(ProcessorLimit, IsFoundInVersionOne) {
  SetGroups("5:cpuset:/other\n4:cpu,cpuacct:/slurm/job_7\n0::/\n");
  Set("cpu/slurm/job_7/cpu.cfs_quota_us", "-1");
  Set("cpu/slurm/job_7/cpu.cfs_period_us", "100000");
  EXPECT_EQ(Limit(), -1);
  Set("cpu/slurm/cpu.cfs_quota_us", "600000");
  EXPECT_EQ(Limit(), -1) << "without a period";
  Set("cpu/slurm/cpu.cfs_period_us", "200000");
  EXPECT_EQ(Limit(), 3);
}

TEST_F(ProcessorLimit, WhatIsNoNumberLimitsNothing) {
  Set("cpu.max", "");
  EXPECT_EQ(Limit(), -1);
  Set("cpu.max", "100000 0");
  EXPECT_EQ(Limit(), -1);
}

// `taskset` and a scheduler's cpusets.
TEST(NumProcessors, AreThoseThatTheProcessMayRunOn) {
  const int num_before = NumProcessors();
  EXPECT_GE(num_before, 1);
  cpu_set_t all;
  CPU_ZERO(&all);
  ASSERT_EQ(sched_getaffinity(0, sizeof(all), &all), 0);
  EXPECT_LE(num_before, CPU_COUNT(&all));
}

}  // namespace
}  // namespace colmap_ext

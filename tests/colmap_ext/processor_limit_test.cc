#include "colmap_ext/processor_limit.h"

#include <sched.h>

#include <gtest/gtest.h>

#include "tests/support/control_group_files.h"

namespace colmap_ext {
namespace {

class ProcessorLimit : public ::testing::Test {
 protected:
  double Limit() const { return ControlGroupProcessorLimit(files_.root()).value_or(-1); }

  test_support::ControlGroupFiles files_;
};

TEST_F(ProcessorLimit, IsNoneWhereNothingTellsOfGroups) { EXPECT_EQ(Limit(), -1); }

// As a container with `--cpus 2.5` has it, below a pod with more.
TEST_F(ProcessorLimit, IsTheLeastUpToTheRoot) {
  files_.SetGroups("0::/kubepods/pod1/container\n");
  files_.Set("kubepods/pod1/container/cpu.max", "max 100000");
  EXPECT_EQ(Limit(), -1);
  files_.Set("kubepods/pod1/cpu.max", "250000 100000");
  EXPECT_EQ(Limit(), 2.5);
  files_.Set("kubepods/pod2/cpu.max", "1000 100000");  // another's
  EXPECT_EQ(Limit(), 2.5);
  files_.Set("cpu.max", "800000 200000");
  EXPECT_EQ(Limit(), 2.5);
  files_.Set("cpu.max", "100000 50000");
  EXPECT_EQ(Limit(), 2);
}

TEST_F(ProcessorLimit, IsFoundInVersionOne) {
  files_.SetGroups("5:cpuset:/other\n4:cpu,cpuacct:/slurm/job_7\n0::/\n");
  files_.Set("cpu/slurm/job_7/cpu.cfs_quota_us", "-1");
  files_.Set("cpu/slurm/job_7/cpu.cfs_period_us", "100000");
  EXPECT_EQ(Limit(), -1);
  files_.Set("cpu/slurm/cpu.cfs_quota_us", "600000");
  EXPECT_EQ(Limit(), -1) << "without a period";
  files_.Set("cpu/slurm/cpu.cfs_period_us", "200000");
  EXPECT_EQ(Limit(), 3);
}

TEST_F(ProcessorLimit, WhatIsNoNumberLimitsNothing) {
  files_.Set("cpu.max", "");
  EXPECT_EQ(Limit(), -1);
  files_.Set("cpu.max", "100000 0");
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

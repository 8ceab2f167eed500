#include "colmap_ext/fusion/fusion_backend.h"

#include <gtest/gtest.h>

#include "phi/base/error.h"

namespace colmap_ext {
namespace {

// Whoever keeps stereo off the first GPU means fusion, too.
TEST(FusionBackendTest, TakesTheFirstGpuOfStereoAndItsMemory) {
  EXPECT_EQ(FirstGpu({}).index, 0);
  EXPECT_EQ(FirstGpu({}).memory_bytes, 0);
  EXPECT_EQ(FirstGpu({.gpu_index = "3"}).index, 3);
  EXPECT_EQ(FirstGpu({.gpu_index = "2,0"}).index, 2);
  EXPECT_EQ(FirstGpu({.device_memory_gigabytes = 2}).memory_bytes, std::int64_t{2} << 30);
  EXPECT_THROW(FirstGpu({.gpu_index = "first"}), phi::UsageError);
}

}  // namespace
}  // namespace colmap_ext

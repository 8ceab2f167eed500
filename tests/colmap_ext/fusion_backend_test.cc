#include "colmap_ext/fusion/fusion_backend.h"

#include <gtest/gtest.h>

#include <vector>

#include "phi/base/error.h"

namespace colmap_ext {
namespace {

// Whoever keeps stereo off the first GPU means fusion, too.
TEST(FusionBackendTest, TakesTheGpusOfStereoAndTheirMemory) {
  EXPECT_TRUE(GpusOf({}).indices.empty());
  EXPECT_EQ(GpusOf({}).memory_bytes, 0);
  EXPECT_EQ(GpusOf({.gpu_index = "3"}).indices, std::vector<int>{3});
  EXPECT_EQ(GpusOf({.gpu_index = "2,0"}).indices, (std::vector<int>{2, 0}));
  EXPECT_EQ(GpusOf({.device_memory_gigabytes = 2}).memory_bytes, std::int64_t{2} << 30);
  EXPECT_THROW(GpusOf({.gpu_index = "first"}), phi::UsageError);
}

}  // namespace
}  // namespace colmap_ext

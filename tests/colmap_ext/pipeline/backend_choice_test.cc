#include "colmap_ext/pipeline/backend_choice.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "phi/base/error.h"

namespace colmap_ext {
namespace {

TEST(GpuIndicesTest, ReadsColmapsSpelling) {
  EXPECT_EQ(ParseGpuIndices("-1"), std::vector<int>{-1});
  EXPECT_EQ(ParseGpuIndices("0,1, 3"), (std::vector<int>{0, 1, 3}));
  EXPECT_THROW(ParseGpuIndices(""), phi::UsageError);
  EXPECT_THROW(ParseGpuIndices("0,x"), phi::UsageError);
  EXPECT_THROW(ParseGpuIndices("-2"), phi::UsageError);
}

TEST(MakeBackendsTest, AutoTakesTheCpuWhereNoGpuWorks) {
  EXPECT_FALSE(MakeBackends(BackendOptions()).empty());
}

TEST(GpuStartTest, RefusesWhatIsNoIndexAndSaysNothingElse) {
  BackendOptions options;
  options.gpu_index = "0,x";
  EXPECT_THROW(GpuStart{options}, phi::UsageError);
  options.kind = BackendKind::kCpu;
  EXPECT_NO_THROW(GpuStart{options});
  options.kind = BackendKind::kCuda;
  for (const char* index : {"-1", "0", "1000"}) {
    options.gpu_index = index;
    EXPECT_NO_THROW(GpuStart{options}) << index;
  }
}

// Without any backend the images would wait forever.
TEST(MakeBackendsTest, CudaIsAGpuOrAnErrorThatNamesTheCpuBackend) {
  BackendOptions options;
  options.kind = BackendKind::kCuda;
  try {
    EXPECT_FALSE(MakeBackends(options).empty());
  } catch (const phi::NoDeviceError& error) {
    EXPECT_EQ(static_cast<int>(error.code()), 5);
    EXPECT_NE(std::string(error.what()).find("--PhiStereo.backend cpu"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace colmap_ext

#include <memory>
#include <string>

#include "cuda/buffer.h"
#include "cuda/device_cache.h"
#include "cuda/self_test.h"
#include "phi/base/error.h"
#include "tests/cuda/cuda_test_fixture.h"

namespace phi::gpu {
namespace {

class ResourcesTest : public CudaTest {};

struct CountedCopy {
  int value;
};

// A cache whose uploads are counted. No device memory is taken.
struct CountedCache {
  int num_uploads = 0;
  DeviceCache<int, CountedCopy> cache{[this](const int& host, cudaStream_t) {
    ++num_uploads;
    return std::make_shared<const CountedCopy>(CountedCopy{host});
  }};
};

TEST_F(ResourcesTest, OutOfMemorySaysWhatIsNeededAndWhatIsFree) {
  const Task task{"estimation", "a/b.jpg", 6000, 4000};
  try {
    DeviceBuffer<float> buffer(std::int64_t{1} << 46, task);
    FAIL() << "an allocation of 256 TiB succeeded";
  } catch (const OutOfDeviceMemory& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.code(), ExitCode::kOutOfResources);
    for (const char* part : {"estimation", "a/b.jpg", "6000x4000", "needs 281474976.7 MB", "are free"}) {
      EXPECT_NE(message.find(part), std::string::npos) << part << " is not in: " << message;
    }
  }
  EXPECT_NO_THROW(DeviceBuffer<float>(1024, task)) << "the error must not stick";
}

TEST_F(ResourcesTest, CacheKeepsWhatWasUsedLast) {
  const Task task{"test"};
  const Stream stream(task);
  CountedCache counted;
  const auto a = std::make_shared<const int>(10), b = std::make_shared<const int>(20);
  const auto c = std::make_shared<const int>(30);
  for (const auto& host : {a, b, c, a}) counted.cache.Get(host, stream.get(), task);
  const std::shared_ptr<const CountedCopy> held = counted.cache.Get(b, stream.get(), task);
  counted.cache.KeepAtMost(2);  // b and a
  EXPECT_EQ(counted.num_uploads, 3);
  counted.cache.Get(a, stream.get(), task);
  EXPECT_EQ(counted.num_uploads, 3);
  counted.cache.Get(c, stream.get(), task);  // in b's place
  EXPECT_EQ(counted.num_uploads, 4);
  counted.cache.Get(a, stream.get(), task);
  EXPECT_EQ(counted.num_uploads, 4);
  counted.cache.KeepAtMost(0);
  EXPECT_EQ(held->value, 20);
}

TEST_F(ResourcesTest, CacheForgetsWhatTheHostFreed) {
  const Task task{"test"};
  const Stream stream(task);
  CountedCache counted;
  for (int i = 0; i < 3; ++i) counted.cache.Get(std::make_shared<const int>(10), stream.get(), task);
  EXPECT_EQ(counted.num_uploads, 3);
}

TEST_F(ResourcesTest, EveryDevicePassesTheSelfTest) {
  for (int index = 0; index < NumCudaDevices(nullptr); ++index) {
    EXPECT_NO_THROW(RequireWorkingDevice(QueryDevice(index)));
    const SelfTestReport report =
        RunSelfTest(QueryDevice(index), {.width = 96, .height = 72, .num_iterations = 3});
    EXPECT_GT(report.agreement, 0.95);
    EXPECT_NEAR(report.accuracy, report.cpu_accuracy, 0.01);
    EXPECT_GT(report.cpu_accuracy, 0.6);
  }
}

TEST(CudaDevices, AnIndexThatDoesNotExistIsAUsageError) {
  if (NumCudaDevices(nullptr) == 0) GTEST_SKIP() << "no GPU: a missing device";
  try {
    MakeCudaBackends({1000});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kUsage);
    EXPECT_NE(std::string(error.what()).find("gpu_index"), std::string::npos);
  }
}

}  // namespace
}  // namespace phi::gpu

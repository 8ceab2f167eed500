#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "cuda/buffer.h"
#include "cuda/cuda_backend.h"
#include "cuda/device_cache.h"
#include "cuda/device_resources.h"
#include "cuda/scratch_pool.h"
#include "cuda/self_test.h"
#include "cuda/stream.h"
#include "phi/base/error.h"
#include "tests/cuda/cuda_test_fixture.h"

namespace phi::gpu {
namespace {

class ResourcesTest : public CudaTest {};

struct CountedCopy {
  int value = 0;
  bool is_new = true;
};

// A cache whose uploads are counted. No device memory is taken.
struct CountedCache {
  std::atomic<int> num_uploads = 0, num_reused = 0;
  std::function<void(int host)> during_upload = [](int) {};
  DeviceCache<int, CountedCopy> cache{[this](const int& host, cudaStream_t, CountedCopy* copy) {
    ++num_uploads;
    during_upload(host);
    num_reused += copy->is_new ? 0 : 1;
    *copy = {host, false};
  }};

  int Get(const std::shared_ptr<const int>& host) { return cache.Get(host, nullptr)->value; }
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

// As device.cc asks: a thread that has chosen no device.
CUcontext CurrentContext() {
  void* get = nullptr;
#if CUDART_VERSION >= 12050
  cudaGetDriverEntryPointByVersion("cuCtxGetCurrent", &get, 4000, cudaEnableDefault);
#else
  cudaGetDriverEntryPoint("cuCtxGetCurrent", &get, cudaEnableDefault);
#endif
  CUcontext context = nullptr;
  reinterpret_cast<CUresult (*)(CUcontext*)>(get)(&context);
  return context;
}

TEST_F(ResourcesTest, AScopedDeviceLeavesTheThreadAsItWas) {
  std::thread([] {
    {
      const ScopedDevice current(0);
      EXPECT_NE(CurrentContext(), nullptr);
      const ScopedDevice again(0);
    }
    EXPECT_EQ(CurrentContext(), nullptr) << "to choose a device starts it";
    EXPECT_EQ(cudaSetDevice(0), cudaSuccess);
    const CUcontext own = CurrentContext();
    { const ScopedDevice current(0); }
    EXPECT_EQ(CurrentContext(), own);
  }).join();
}

TEST(DevicesNamed, NoneOrMinusOneMeansAll) {
  EXPECT_EQ(DevicesNamed({}, 2), (std::vector<int>{0, 1}));
  EXPECT_EQ(DevicesNamed({-1}, 3), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(DevicesNamed({-1}, 0), std::vector<int>());
  EXPECT_EQ(DevicesNamed({5, 1}, 2), (std::vector<int>{5, 1})) << "whether they are there is asked later";
}

// With a GPU and without one.
TEST(StartDevices, LeavesTheThreadAsItWasAndSaysNothingOfDevicesThatAreNot) {
  std::thread([] {
    const int count = NumCudaDevices(nullptr);
    for (const std::vector<int>& indices : {std::vector<int>{}, {-1}, {0}, {1000}}) StartDevices(indices);
    EXPECT_EQ(NumCudaDevices(nullptr), count);
    if (count > 0) {
      EXPECT_EQ(CurrentContext(), nullptr);
    }
  }).join();
}

// A call that failed leaves work on either stream, and the next one takes its buffers.
TEST_F(ResourcesTest, AScratchComesBackWhenTheDeviceHasEndedWithIt) {
  DeviceResources device(QueryDevice(0), 10000);
  const ScopedDevice current(0);
  for (const bool is_estimation : {false, true}) {
    std::atomic<bool> has_ended = false;
    {
      const ScratchPool<Scratch>::Lease scratch(&device.scratch, Task{});
      const Stream& stream = is_estimation ? scratch->estimation.stream : scratch->stream;
      const auto end_later = [](void* ended) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        *static_cast<std::atomic<bool>*>(ended) = true;
      };
      ASSERT_EQ(cudaLaunchHostFunc(stream.get(), end_later, &has_ended), cudaSuccess);
    }
    EXPECT_TRUE(has_ended) << (is_estimation ? "the estimation's stream" : "the other one");
  }
}

// Else calls that need the device for a moment would wait for those that keep it busy.
TEST_F(ResourcesTest, EstimationsGiveWay) {
  const ScopedDevice current(0);
  int lowest = 0, highest = 0, of_estimation = -1, of_others = -1;
  ASSERT_EQ(cudaDeviceGetStreamPriorityRange(&lowest, &highest), cudaSuccess);
  const Scratch scratch(Task{});
  ASSERT_EQ(cudaStreamGetPriority(scratch.estimation.stream.get(), &of_estimation), cudaSuccess);
  ASSERT_EQ(cudaStreamGetPriority(scratch.stream.get(), &of_others), cudaSuccess);
  EXPECT_EQ(of_estimation, lowest);
  EXPECT_EQ(of_others, highest);
}

TEST_F(ResourcesTest, AnErrorOfAnotherUserOfTheThreadIsNoneOfOurs) {
  EXPECT_NE(cudaSetDevice(1 << 20), cudaSuccess);
  const ScopedDevice current(0);
  EXPECT_NO_THROW(CheckLaunch("a kernel", Task{}));
}

TEST_F(ResourcesTest, OutOfMemoryIsOneInWhateverCall) {
  EXPECT_THROW(Check(cudaErrorMemoryAllocation, "cudaStreamCreate", Task{}), OutOfDeviceMemory);
  EXPECT_THROW(Check(cudaErrorLaunchFailure, "a kernel", Task{}), DeviceError);
}

// What the budget does not hold beside the call at hand.
TEST_F(ResourcesTest, ACallKeepsNoMemoryOfAnotherKindNorMoreThanItMayTake) {
  DeviceResources device(QueryDevice(0), 10000);
  const ScopedDevice current(0);
  const ScratchPool<Scratch>::Lease scratch(&device.scratch, Task{});
  scratch->plane.Reserve(100, Task{});
  scratch->verdicts.Reserve(100, Task{});
  device.MakeRoom(CallKind::kFilter, 5000, {}, scratch.get());
  EXPECT_EQ(scratch->DeviceMapBytes(), 0);
  scratch->verdicts.Reserve(4000, Task{});
  device.MakeRoom(CallKind::kFilter, 5000, {}, scratch.get());
  EXPECT_GE(scratch->DeviceMapBytes(), 4000);
  device.MakeRoom(CallKind::kFilter, 3000, {}, scratch.get());
  EXPECT_EQ(scratch->DeviceMapBytes(), 0);
}

struct EmptyScratch {
  explicit EmptyScratch(const Task& task) : stream(task) {}
  void Settle() const { stream.Settle(); }
  Stream stream;
};

TEST_F(ResourcesTest, APoolLendsNoMoreThanItMayAndKeepsWhatComesBack) {
  using Lease = ScratchPool<EmptyScratch>::Lease;
  ScratchPool<EmptyScratch> pool(1);
  auto first = std::make_unique<Lease>(&pool, Task{});
  const EmptyScratch* const scratch = first->get();
  auto second = std::async(std::launch::async, [&] {
    const Lease lease(&pool, Task{});
    return static_cast<const EmptyScratch*>(lease.get());
  });
  EXPECT_EQ(second.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout) << "it waits for the first";
  first.reset();
  EXPECT_EQ(second.get(), scratch);
}

TEST(DeviceCache, KeepsWhatWasUsedLast) {
  CountedCache counted;
  counted.cache.KeepAtLeast(3);
  const auto a = std::make_shared<const int>(10), b = std::make_shared<const int>(20);
  const auto c = std::make_shared<const int>(30);
  for (const auto& host : {a, b, c, a}) EXPECT_EQ(counted.Get(host), *host);
  const std::shared_ptr<const CountedCopy> held = counted.cache.Get(b, nullptr);
  counted.cache.KeepAtMost(2);  // b and a
  EXPECT_EQ(counted.num_uploads, 3);
  EXPECT_EQ(counted.Get(a), 10);
  EXPECT_EQ(counted.num_uploads, 3);
  counted.Get(c);  // in the place of b, which is held
  EXPECT_EQ(counted.num_uploads, 4);
  EXPECT_EQ(held->value, 20);
  counted.Get(c);
  EXPECT_EQ(counted.num_uploads, 4);
  counted.cache.KeepAtMost(0);
  EXPECT_EQ(held->value, 20);
}

TEST(DeviceCache, ForgetsWhatTheHostFreed) {
  CountedCache counted;
  counted.cache.KeepAtLeast(3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(counted.Get(std::make_shared<const int>(i)), i);
  EXPECT_EQ(counted.num_uploads, 3);
  EXPECT_EQ(counted.num_reused, 2) << "its memory serves the next";
}

TEST(DeviceCache, TakesTheMemoryOfWhatWasUsedLongestAgo) {
  CountedCache counted;
  counted.cache.KeepAtLeast(2);
  const auto a = std::make_shared<const int>(10), b = std::make_shared<const int>(20), c = std::make_shared<const int>(30);
  counted.Get(a);
  const CountedCopy* first = counted.cache.Get(b, nullptr).get();
  counted.Get(a);
  EXPECT_EQ(counted.num_reused, 0) << "there is room";
  EXPECT_EQ(counted.cache.Get(c, nullptr).get(), first);
  EXPECT_EQ(counted.Get(a), 10);
  EXPECT_EQ(counted.num_uploads, 3);
  counted.cache.KeepAtLeast(1);
  counted.Get(a);
  EXPECT_EQ(counted.Get(c), 30);
  EXPECT_EQ(counted.num_uploads, 3) << "no fewer are kept";
}

TEST(DeviceCache, NeverTakesMemoryThatACallHolds) {
  CountedCache counted;
  counted.cache.KeepAtLeast(1);
  auto a = std::make_shared<const int>(10);
  const std::shared_ptr<const CountedCopy> held = counted.cache.Get(a, nullptr);
  a.reset();
  counted.Get(std::make_shared<const int>(20));
  EXPECT_EQ(held->value, 10);
  EXPECT_EQ(counted.num_reused, 0);
}

TEST(DeviceCache, FindsCopiesWhileAnotherIsUploaded) {
  CountedCache counted;
  counted.cache.KeepAtLeast(4);
  const auto there = std::make_shared<const int>(1), slow = std::make_shared<const int>(2);
  counted.Get(there);
  std::promise<void> began, go_on;
  counted.during_upload = [&](int) {
    began.set_value();
    go_on.get_future().wait();
  };
  const auto get_slow = [&] { return counted.Get(slow); };
  std::future<int> first = std::async(std::launch::async, get_slow);
  began.get_future().wait();
  EXPECT_EQ(counted.Get(there), 1);
  std::future<int> second = std::async(std::launch::async, get_slow);
  EXPECT_EQ(second.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  go_on.set_value();
  EXPECT_EQ(first.get(), 2);
  EXPECT_EQ(second.get(), 2);
  EXPECT_EQ(counted.num_uploads, 2) << "one for both";
}

TEST(DeviceCache, TriesAnewAfterAFailure) {
  CountedCache counted;
  counted.cache.KeepAtLeast(2);
  const auto a = std::make_shared<const int>(10);
  counted.during_upload = [](int) { throw DeviceError("no memory"); };
  EXPECT_THROW(counted.Get(a), DeviceError);
  counted.during_upload = [](int) {};
  EXPECT_EQ(counted.Get(a), 10);
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

TEST(CudaDevices, MoreSmallImagesAreDoneAtOnce) {
  EXPECT_EQ(NumConcurrentCalls(0), 4) << "not known";
  EXPECT_EQ(NumConcurrentCalls(24'000'000), 4);
  EXPECT_EQ(NumConcurrentCalls(3072 * 2048), 4);
  EXPECT_EQ(NumConcurrentCalls(2'000'000), 6);
  EXPECT_EQ(NumConcurrentCalls(1'000'000), 8);
  EXPECT_EQ(NumConcurrentCalls(1), 8);
}

// What it kept for calls to come was nothing that they need.
TEST_F(ResourcesTest, FreedMemoryIsTakenAnew) {
  const auto backend = std::move(MakeCudaBackends({0}).front());
  const auto image = std::make_shared<GrayImage>(64, 48, 90);
  (*image)(20, 20) = 200;
  SceneView view, other;
  view.camera.pinhole = other.camera.pinhole = {64, 48, 60, 60, 32, 24};
  other.camera.pose.translation = {-0.1, 0, 0};
  EstimationInput input;
  input.reference = {&view, image};
  input.sources = {{&other, image}};
  input.depth_min = 1, input.depth_max = 4;
  const EstimationResult first = backend->Estimate(input, StereoOptions());
  backend->FreeMemory();
  const EstimationResult again = backend->Estimate(input, StereoOptions());
  EXPECT_EQ(std::memcmp(first.map.data(), again.map.data(), first.map.size() * sizeof(PlaneHypothesis)), 0);
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

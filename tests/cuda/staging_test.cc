#include "cuda/staging.h"

#include <cstdint>
#include <numeric>
#include <thread>
#include <vector>

#include "tests/cuda/cuda_test_fixture.h"

namespace phi::gpu {
namespace {

class StagingTest : public CudaTest {};

std::vector<std::int32_t> UploadedAndBack(const std::vector<std::int32_t>& host, StagingPool* staging) {
  const Task task{"test"};
  const auto count = static_cast<std::int64_t>(host.size());
  const DeviceBuffer<std::int32_t> device(count + 1, task);
  staging->Upload(host.data(), count, device.data(), task);
  const Stream stream(task);
  std::vector<std::int32_t> back(host.size());
  CopyToHost(back.data(), device.data(), count, stream.get(), task);
  stream.Synchronize(task);
  return back;
}

std::vector<std::int32_t> Numbers(std::size_t count, int first) {
  std::vector<std::int32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), first);
  return numbers;
}

// Memory of 8 MB holds two million: less than one, whole ones, and a little more than two.
TEST_F(StagingTest, EachPartArrives) {
  StagingPool staging;
  constexpr std::size_t kPart = std::size_t{2} << 20;
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, kPart, 2 * kPart + 7, 5 * kPart}) {
    const std::vector<std::int32_t> host = Numbers(count, 3);
    EXPECT_EQ(UploadedAndBack(host, &staging), host) << count;
  }
  staging.FreeIdle();
  EXPECT_EQ(UploadedAndBack({1, 2, 3}, &staging), (std::vector<std::int32_t>{1, 2, 3}));
}

// More than there is staging memory for wait for each other.
TEST_F(StagingTest, UploadsOfSeveralThreadsStayApart) {
  StagingPool staging;
  std::vector<std::thread> threads;
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&, i] {
      const std::vector<std::int32_t> host = Numbers(5'000'000, 1000 * i);
      EXPECT_EQ(UploadedAndBack(host, &staging), host) << i;
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace phi::gpu

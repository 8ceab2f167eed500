#include "cuda/device_resources.h"

#include <algorithm>
#include <memory>

namespace phi::gpu {
namespace {

std::int64_t FreeBytes(const Task& task) {
  std::size_t free = 0, total = 0;
  Check(cudaMemGetInfo(&free, &total), "cudaMemGetInfo", task);
  return static_cast<std::int64_t>(free);
}

// Left free: the driver's own needs grow with the kernels in use, and allocations are rounded up.
std::int64_t LessReserve(std::int64_t free) {
  constexpr std::int64_t kShare = 16, kLeast = std::int64_t{256} << 20;
  return std::max<std::int64_t>(free - std::max(free / kShare, kLeast), 0);
}

}  // namespace

DeviceResources::DeviceResources(const DeviceProperties& p, std::int64_t budget_bytes)
    : properties(p),
      budget(budget_bytes > 0 ? budget_bytes : LessReserve(FreeBytes(Task{"set-up"}))),
      images([](const GrayImage& image, cudaStream_t stream) {
        const Task task{"image upload", "", image.width(), image.height()};
        return std::make_shared<const GrayPyramid>(image, stream, task);
      }),
      maps([](const PlaneMap& map, cudaStream_t stream) {
        const Task task{"map upload", "", map.width(), map.height()};
        return std::make_shared<const DeviceMap>(map, stream, task);
      }),
      depths([](const DepthMap& depths, cudaStream_t stream) {
        const Task task{"depth map upload", "", depths.width(), depths.height()};
        return std::make_shared<const DeviceDepths>(depths, stream, task);
      }),
      measured([](const MeasuredDepths& depths, cudaStream_t stream) {
        const Task task{"measured depths' upload", "", depths.width(), depths.height()};
        return std::make_shared<const DeviceMeasuredDepths>(depths, stream, task);
      }),
      times(Task{"set-up"}) {}

std::size_t DeviceResources::NumCallsAtOnce(std::int64_t bytes) {
  const std::int64_t num_calls = std::clamp<std::int64_t>(budget.bytes() / bytes, 1, kConcurrentCalls);
  if (num_calls == 1) scratch.FreeIdle();
  return static_cast<std::size_t>(num_calls);
}

bool DeviceResources::HoldsAllKinds(std::int64_t bytes) {
  std::int64_t largest = largest_call_;
  while (bytes > largest && !largest_call_.compare_exchange_weak(largest, bytes)) {
  }
  // Of each kind the scratch memory of all calls at once, or what a cache keeps for as many.
  constexpr int kKinds = 3, kCalls = NumCallsOfAllStages(kConcurrentCalls);
  return kKinds * kCalls * std::max(largest, bytes) <= budget.bytes();
}

void DeviceResources::MakeRoom(CallKind kind, std::int64_t bytes, const CacheSizes& sizes, Scratch* own) {
  if (HoldsAllKinds(bytes)) {
    const auto keep = [](auto* cache, std::size_t size) {
      if (size > 0) cache->KeepAtMost(size);
    };
    keep(&images, sizes.images);
    keep(&maps, sizes.maps);
    keep(&depths, sizes.depths);
    keep(&measured, sizes.measured);
    return;
  }
  KeepOnly(sizes);
  scratch.FreeIdleDeviceMaps();
  if (kind != CallKind::kEstimation) own->estimation.FreeDeviceMaps();
  if (kind != CallKind::kInference) own->inference.FreeDeviceMaps();
}

void DeviceResources::KeepOnly(const CacheSizes& sizes) {
  images.KeepAtMost(sizes.images);
  maps.KeepAtMost(sizes.maps);
  depths.KeepAtMost(sizes.depths);
  measured.KeepAtMost(sizes.measured);
}

void DeviceResources::RecoverMemory(const Task& task) {
  KeepOnly({});
  scratch.FreeIdle();
  budget.Lower(LessReserve(FreeBytes(task)));
}

void DeviceResources::NoteMemory(const Task& task) {
  std::size_t free = 0, total = 0;
  Check(cudaMemGetInfo(&free, &total), "cudaMemGetInfo", task);
  const std::int64_t now = static_cast<std::int64_t>(total - free);
  std::int64_t peak = peak_bytes;
  while (now > peak && !peak_bytes.compare_exchange_weak(peak, now)) {
  }
}

}  // namespace phi::gpu

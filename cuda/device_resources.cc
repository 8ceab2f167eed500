#include "cuda/device_resources.h"

#include <algorithm>

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

template <typename Map>
Task UploadTask(const char* stage, const Map& map) {
  return {stage, "", map.width(), map.height()};
}

void UploadImage(const GrayImage& image, cudaStream_t stream, GrayPyramid* copy) {
  copy->Upload(image, stream, UploadTask("image upload", image));
}

template <typename Host, typename Device>
typename DeviceCache<Host, Device>::Upload UploadBy(StagingPool* staging, const char* stage) {
  return [=](const Host& host, cudaStream_t, Device* copy) { copy->Upload(host, staging, UploadTask(stage, host)); };
}

}  // namespace

DeviceResources::DeviceResources(const DeviceProperties& p, std::int64_t budget_bytes, std::int64_t num_pixels)
    : properties(p),
      num_concurrent_calls(NumConcurrentCalls(num_pixels)),
      budget(budget_bytes > 0 ? budget_bytes : LessReserve(FreeBytes(Task{"set-up"}))),
      images(UploadImage),
      maps(UploadBy<PlaneMap, DeviceMap>(&staging, "map upload")),
      measured(UploadBy<MeasuredDepths, DeviceMeasuredDepths>(&staging, "measured depths' upload")),
      times(Task{"set-up"}) {}

std::size_t DeviceResources::NumCallsAtOnce(std::int64_t bytes) {
  return static_cast<std::size_t>(std::clamp<std::int64_t>(budget.bytes() / bytes, 1, num_concurrent_calls));
}

bool DeviceResources::HoldsAllKinds(std::int64_t bytes) {
  std::int64_t largest = largest_call_;
  while (bytes > largest && !largest_call_.compare_exchange_weak(largest, bytes)) {
  }
  // Of each kind the scratch memory of all calls at once, or what a cache keeps for as many.
  return kNumCallKinds * NumCallsOfAllStages(num_concurrent_calls) * std::max(largest, bytes) <= budget.bytes();
}

void DeviceResources::MakeRoom(CallKind kind, std::int64_t bytes, const CacheSizes& sizes, Scratch* own) {
  const bool is_of_another_kind = own->last_use != kind;
  own->last_use = kind;
  if (HoldsAllKinds(bytes)) {
    const auto times = static_cast<std::size_t>(NumCallsOfAllStages(num_concurrent_calls) / num_concurrent_calls);
    images.KeepAtLeast(times * sizes.images);
    maps.KeepAtLeast(times * sizes.maps);
    measured.KeepAtLeast(times * sizes.measured);
    return;
  }
  KeepOnly(sizes);
  scratch.ForEachIdle([](Scratch* idle) { idle->FreeDeviceMaps(); });
  if (is_of_another_kind || own->DeviceMapBytes() > bytes) own->FreeDeviceMaps();
}

void DeviceResources::KeepOnly(const CacheSizes& sizes) {
  images.KeepAtMost(sizes.images);
  maps.KeepAtMost(sizes.maps);
  measured.KeepAtMost(sizes.measured);
}

void DeviceResources::FreeIdle() {
  KeepOnly({});
  staging.FreeIdle();
  scratch.FreeIdle();
}

void DeviceResources::LookForMemory(const Task& task) {
  FreeIdle();
  budget.Set(LessReserve(FreeBytes(task)));
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

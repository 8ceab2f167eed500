// What the calls on one device share: its memory budget, cached images and maps, scratch memory, measured times.
//
// Memory: calls of all kinds come side by side. Caches keep what the calls at once work on; where the budget cannot hold that of
// all kinds, what the calls of the kind at hand do, and each call first gives up what only other kinds need. cuda/memory_plan.h says what a
// call takes.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>

#include "cuda/call_kind.h"
#include "cuda/device.h"
#include "cuda/device_cache.h"
#include "cuda/device_map.h"
#include "cuda/device_times.h"
#include "cuda/gray_texture.h"
#include "cuda/memory_budget.h"
#include "cuda/scratch.h"
#include "cuda/scratch_pool.h"
#include "cuda/staging.h"
#include "phi/backend.h"

namespace phi::gpu {

// How many entries each cache keeps for the calls of one kind.
struct CacheSizes {
  std::size_t images = 0, maps = 0, measured = 0;
};

// Of one kind that keep the device busy: one computes while another uploads or downloads, and two are at the host's part of their work. Of
// small images more are, since that part takes longer than the device's. num_pixels: of the largest image; 0: not known.
constexpr int NumConcurrentCalls(std::int64_t num_pixels) {
  constexpr std::int64_t kPixelsAtOnce = 12'000'000, kLeast = 4, kMost = 8;
  return static_cast<int>(num_pixels > 0 ? std::clamp(kPixelsAtOnce / num_pixels, kLeast, kMost) : kLeast);
}

struct DeviceResources {
  // The device must be current, also at destruction. budget_bytes <= 0: what is free on the device now, less a reserve. num_pixels:
  // NumConcurrentCalls'.
  DeviceResources(const DeviceProperties& properties, std::int64_t budget_bytes, std::int64_t num_pixels = 0);

  // Calls of `bytes` that the budget lets run side by side.
  std::size_t NumCallsAtOnce(std::int64_t bytes);

  // For a call of `bytes` that uses this scratch memory, before it takes any. sizes: of the caches that its kind uses; 0: other kinds do.
  void MakeRoom(CallKind kind, std::int64_t bytes, const CacheSizes& sizes, Scratch* own);

  // Frees what no running call holds.
  void FreeIdle();
  // While no other call runs (MemoryBudget::Alone): frees all, and takes for the budget what there is, or what was allowed at first.
  void LookForMemory(const Task& task);

  // Device memory in use now counts for the peak. Other programs' share counts too.
  void NoteMemory(const Task& task);

  DeviceProperties properties;
  const int num_concurrent_calls;  // of a kind
  MemoryBudget budget;
  std::atomic<std::int64_t> peak_bytes = 0;
  StagingPool staging;
  DeviceCache<GrayImage, GrayPyramid> images;
  DeviceCache<PlaneMap, DeviceMap> maps;
  DeviceCache<MeasuredDepths, DeviceMeasuredDepths> measured;  // for inference
  ScratchPool<Scratch> scratch;
  DeviceTimes times;

 private:
  // Whether the budget holds what calls of all kinds keep, if none takes more than the largest so far.
  bool HoldsAllKinds(std::int64_t bytes);
  void KeepOnly(const CacheSizes& sizes);

  std::atomic<std::int64_t> largest_call_ = 0;  // bytes
};

}  // namespace phi::gpu

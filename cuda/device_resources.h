// What the calls on one device share: cached images and maps, scratch memory, measured times. And the
// three kinds of call.
//
// Memory: a stage's calls come in a row, so each kind of call first gives up what only other kinds need, and caches keep
// what two concurrent calls work on. Never more than a quarter of the card for images, and for maps.
#pragma once

#include <atomic>
#include <cstdint>

#include "cuda/device.h"
#include "cuda/device_cache.h"
#include "cuda/device_map.h"
#include "cuda/device_times.h"
#include "cuda/gray_texture.h"
#include "cuda/scratch.h"
#include "phi/backend.h"

namespace phi::gpu {

struct DeviceResources {
  // The device must be current, also at destruction.
  explicit DeviceResources(const DeviceProperties& properties);

  // Device memory in use now counts for the peak. Other programs' share counts too.
  void NoteMemory(const Task& task);

  DeviceProperties properties;
  std::atomic<std::int64_t> peak_bytes = 0;
  DeviceCache<GrayImage, GrayPyramid> images;
  DeviceCache<PlaneMap, DeviceMap> maps;
  DeviceCache<PlaneMap, DeviceDepths> depths;
  ScratchPool scratch;
  DeviceTimes times;
};

EstimationResult EstimateOnGpu(DeviceResources* device, const EstimationInput& input,
                               const StereoOptions& options);
PlaneMap FilterOnGpu(DeviceResources* device, const FilterInput& input, const FilterOptions& options);
InferenceResult InferOnGpu(DeviceResources* device, const InferenceInput& input, const StereoOptions& stereo,
                           const InferenceOptions& options);

}  // namespace phi::gpu

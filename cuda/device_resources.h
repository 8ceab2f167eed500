// What the calls on one device share: cached images and maps, scratch memory, measured times. And the
// three kinds of call.
#pragma once

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

  DeviceProperties properties;
  DeviceCache<GrayImage, GrayPyramid> images;
  DeviceCache<PlaneMap, DeviceMap> maps;
  ScratchPool scratch;
  DeviceTimes times;
};

EstimationResult EstimateOnGpu(DeviceResources* device, const EstimationInput& input,
                               const StereoOptions& options);
PlaneMap FilterOnGpu(DeviceResources* device, const FilterInput& input, const FilterOptions& options);
InferenceResult InferOnGpu(DeviceResources* device, const InferenceInput& input, const StereoOptions& stereo,
                           const InferenceOptions& options);

}  // namespace phi::gpu

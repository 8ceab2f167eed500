// The calls of the backend on one device, which is current; each in a file of its name.
#pragma once

#include <memory>

#include "cuda/device_resources.h"
#include "phi/backend.h"

namespace phi::gpu {

EstimationResult EstimateOnGpu(DeviceResources* device, const EstimationInput& input,
                               const StereoOptions& options);
std::shared_ptr<const MeasurementMap> ShareOnGpu(DeviceResources* device, const SharingInput& input,
                                                 const StereoOptions& options);
MeasurementMap FilterOnGpu(DeviceResources* device, const FilterInput& input, const FilterOptions& options);
InferenceResult InferOnGpu(DeviceResources* device, const InferenceInput& input, const StereoOptions& stereo,
                           const InferenceOptions& options);

}  // namespace phi::gpu

// The images of an estimation's input on the device, and their textures in a launch.
#pragma once

#include <memory>
#include <vector>

#include "cuda/device_resources.h"
#include "cuda/estimation_kernels.h"
#include "phi/backend.h"

namespace phi::gpu {

using ImageHandle = std::shared_ptr<const GrayPyramid>;

// The reference, then the sources; the handles keep them alive until the call ends.
std::vector<ImageHandle> UploadImages(DeviceResources* device, const EstimationInput& input,
                                      cudaStream_t stream);

// The levels from `level` on. input: of a part at that level.
void BindTextures(const std::vector<ImageHandle>& images, const EstimationInput& input, int level,
                  EstimationLaunch* launch);

// Sets the count of samples to 0 and binds it.
void BindSampleCount(Scratch* scratch, cudaStream_t stream, const Task& task, EstimationLaunch* launch);

}  // namespace phi::gpu

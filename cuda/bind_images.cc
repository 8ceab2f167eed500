#include "cuda/bind_images.h"

#include "phi/matching/estimation_setup.h"

namespace phi::gpu {

std::vector<ImageHandle> UploadImages(DeviceResources* device, const EstimationInput& input,
                                      cudaStream_t stream) {
  std::vector<ImageHandle> handles = {device->images.Get(input.reference.image, stream)};
  for (const ViewImage& source : input.sources) handles.push_back(device->images.Get(source.image, stream));
  return handles;
}

void BindTextures(const std::vector<ImageHandle>& images, const EstimationInput& input, int level,
                  EstimationLaunch* launch) {
  images[0]->CopyTextures(level, launch->reference);
  const std::vector<RelativeView> views = MakeRelativeViews(input);
  for (std::size_t j = 0; j < views.size(); ++j) {
    launch->sources[j] = {views[j].a, views[j].b, views[j].source.width, views[j].source.height, {}};
    images[j + 1]->CopyTextures(level, launch->sources[j].textures);
  }
}

void BindSampleCount(Scratch* scratch, cudaStream_t stream, const Task& task, EstimationLaunch* launch) {
  DeviceBuffer<unsigned long long>& counter = scratch->num_samples;
  counter.Reserve(1, task);
  ClearOnDevice(counter.data(), 1, stream, task);
  launch->num_samples = counter.data();
}

}  // namespace phi::gpu

#include "cuda/gray_texture.h"

#include <utility>
#include <vector>

#include "phi/matching/pyramid.h"
#include "phi/texture_limits.h"

namespace phi::gpu {
namespace {

int Attribute(cudaDeviceAttr attribute, const Task& task) {
  int device = 0, value = 0;
  Check(cudaGetDevice(&device), "cudaGetDevice", task);
  Check(cudaDeviceGetAttribute(&value, attribute, device), "cudaDeviceGetAttribute", task);
  return value;
}

TextureLimits DeviceTextureLimits(const Task& task) {
  return {Attribute(cudaDevAttrMaxTexture2DWidth, task), Attribute(cudaDevAttrMaxTexture2DHeight, task)};
}

}  // namespace

// Delegates, so that the destructor runs when the upload fails.
GrayTexture::GrayTexture(const GrayImage& image, cudaStream_t stream, const Task& task) : GrayTexture() {
  Upload(image, stream, task);
}

void GrayTexture::Upload(const GrayImage& image, cudaStream_t stream, const Task& task) {
  if (image.width() != width_ || image.height() != height_) Make(image.width(), image.height(), task);
  Check(cudaMemcpy2DToArrayAsync(array_, 0, 0, image.data(), image.width(), image.width(), image.height(),
                                 cudaMemcpyHostToDevice, stream),
        "cudaMemcpy2DToArrayAsync", task);
  // A pageable source is staged by the driver, which may still read it after the call: wait for this copy alone.
  Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize after an image's upload", task);
}

void GrayTexture::Make(int width, int height, const Task& task) {
  RequireTextureSize(width, height, DeviceTextureLimits(task), task.Describe());
  Destroy();
  const cudaChannelFormatDesc format = cudaCreateChannelDesc(8, 0, 0, 0, cudaChannelFormatKindUnsigned);
  CheckAllocation(cudaMallocArray(&array_, &format, width, height), "cudaMallocArray", Bytes(width, height), task);
  cudaResourceDesc resource = {};
  resource.resType = cudaResourceTypeArray;
  resource.res.array.array = array_;
  cudaTextureDesc texture = {};
  texture.addressMode[0] = texture.addressMode[1] = cudaAddressModeClamp;
  texture.filterMode = cudaFilterModeLinear;
  texture.readMode = cudaReadModeNormalizedFloat;
  Check(cudaCreateTextureObject(&texture_, &resource, &texture, nullptr), "cudaCreateTextureObject", task);
  width_ = width;
  height_ = height;
}

// Waits for kernels that an error left under way.
void GrayTexture::Destroy() {
  cudaFreeArray(std::exchange(array_, nullptr));
  if (texture_ != 0) cudaDestroyTextureObject(std::exchange(texture_, 0));
  width_ = height_ = 0;
}

GrayTexture::~GrayTexture() { Destroy(); }

std::size_t GrayTexture::Bytes(int width, int height) { return static_cast<std::size_t>(width) * height; }

void GrayPyramid::Upload(const GrayImage& image, cudaStream_t stream, const Task& task) {
  levels_[0].Upload(image, stream, task);
  const std::vector<GrayImage> coarser = BuildPyramid(image, kMaxPyramidLevels);
  for (std::size_t i = 0; i < coarser.size(); ++i) levels_[i + 1].Upload(coarser[i], stream, task);
}

void GrayPyramid::CopyTextures(int first_level, TextureSampler* textures) const {
  for (std::size_t level = first_level; level < levels_.size(); ++level) {
    textures[level - first_level].texture = levels_[level].get();
  }
}

std::size_t GrayPyramid::Bytes(int width, int height) {
  std::size_t sum = 0;
  for (int level = 0; level < kMaxPyramidLevels; ++level) {
    sum += GrayTexture::Bytes(width, height);
    width = (width + 1) / 2;
    height = (height + 1) / 2;
  }
  return sum;
}

}  // namespace phi::gpu

#include "cuda/gray_texture.h"

#include "phi/matching/pyramid.h"
#include "phi/matching/window_level.h"
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

GrayTexture::GrayTexture(const GrayImage& image, cudaStream_t stream, const Task& task) {
  RequireTextureSize(image.width(), image.height(), DeviceTextureLimits(task), task.Describe());
  const cudaChannelFormatDesc format = cudaCreateChannelDesc(8, 0, 0, 0, cudaChannelFormatKindUnsigned);
  CheckAllocation(cudaMallocArray(&array_, &format, image.width(), image.height()), "cudaMallocArray",
                  image.size(), task);
  try {
    Check(cudaMemcpy2DToArrayAsync(array_, 0, 0, image.data(), image.width(), image.width(), image.height(),
                                   cudaMemcpyHostToDevice, stream),
          "cudaMemcpy2DToArrayAsync", task);
    MakeTexture(task);
    // A pageable source is staged by the driver, which may still read it after the call: wait for this copy alone.
    Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize after an image's upload", task);
  } catch (...) {
    Destroy();
    throw;
  }
}

void GrayTexture::MakeTexture(const Task& task) {
  cudaResourceDesc resource = {};
  resource.resType = cudaResourceTypeArray;
  resource.res.array.array = array_;
  cudaTextureDesc texture = {};
  texture.addressMode[0] = texture.addressMode[1] = cudaAddressModeClamp;
  texture.filterMode = cudaFilterModeLinear;
  texture.readMode = cudaReadModeNormalizedFloat;
  Check(cudaCreateTextureObject(&texture_, &resource, &texture, nullptr), "cudaCreateTextureObject", task);
}

void GrayTexture::Destroy() {
  cudaFreeArray(array_);  // waits for kernels that an error left under way
  if (texture_ != 0) cudaDestroyTextureObject(texture_);
}

GrayTexture::~GrayTexture() { Destroy(); }

std::size_t GrayTexture::Bytes(int width, int height) { return static_cast<std::size_t>(width) * height; }

GrayPyramid::GrayPyramid(const GrayImage& image, cudaStream_t stream, const Task& task) {
  levels_.push_back(std::make_unique<GrayTexture>(image, stream, task));
  for (const GrayImage& level : BuildPyramid(image, kMaxPyramidLevels)) {
    levels_.push_back(std::make_unique<GrayTexture>(level, stream, task));
  }
}

void GrayPyramid::CopyTextures(int first_level, TextureSampler* textures) const {
  for (std::size_t level = first_level; level < levels_.size(); ++level) {
    textures[level - first_level].texture = levels_[level]->get();
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

#include "cuda/gray_texture.h"

#include "phi/matching/pyramid.h"

namespace phi::gpu {

GrayTexture::GrayTexture(const GrayImage& image, cudaStream_t stream, const Task& task)
    : quads_(NumQuads(image.width(), image.height()), task), width_(image.width()) {
  const cudaChannelFormatDesc format = cudaCreateChannelDesc(8, 0, 0, 0, cudaChannelFormatKindUnsigned);
  CheckAllocation(cudaMallocArray(&array_, &format, image.width(), image.height()), "cudaMallocArray",
                  image.size(), task);
  bytes_ = image.size() + quads_.bytes();
  try {
    Check(cudaMemcpy2DToArrayAsync(array_, 0, 0, image.data(), image.width(), image.width(), image.height(),
                                   cudaMemcpyHostToDevice, stream),
          "cudaMemcpy2DToArrayAsync", task);
    cudaResourceDesc resource = {};
    resource.resType = cudaResourceTypeArray;
    resource.res.array.array = array_;
    cudaTextureDesc texture = {};
    texture.addressMode[0] = texture.addressMode[1] = cudaAddressModeClamp;
    texture.filterMode = cudaFilterModeLinear;
    texture.readMode = cudaReadModeNormalizedFloat;
    Check(cudaCreateTextureObject(&texture_, &resource, &texture, nullptr), "cudaCreateTextureObject", task);
    LaunchTexelQuads(texture_, image.width(), image.height(), quads_.data(), stream, task);
    // A pageable source is staged by the driver, which may still read it after the call: wait for this copy alone.
    Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize after an image's upload", task);
  } catch (...) {
    cudaFreeArray(array_);
    throw;
  }
}

GrayTexture::~GrayTexture() {
  cudaFreeArray(array_);  // waits for kernels that an error left under way
  cudaDestroyTextureObject(texture_);
}

GrayPyramid::GrayPyramid(const GrayImage& image, cudaStream_t stream, const Task& task) {
  levels_.push_back(std::make_unique<GrayTexture>(image, stream, task));
  for (const GrayImage& level : BuildPyramid(image, kMaxPyramidLevels)) {
    levels_.push_back(std::make_unique<GrayTexture>(level, stream, task));
  }
}

void GrayPyramid::CopyTextures(TextureSampler* textures) const {
  for (std::size_t level = 0; level < levels_.size(); ++level)
    textures[level].texture = levels_[level]->get();
}

void GrayPyramid::CopyQuads(const std::uint32_t** quads) const {
  for (std::size_t level = 0; level < levels_.size(); ++level) quads[level] = levels_[level]->quads().data;
}

std::size_t GrayPyramid::bytes() const {
  std::size_t sum = 0;
  for (const auto& level : levels_) sum += level->bytes();
  return sum;
}

}  // namespace phi::gpu

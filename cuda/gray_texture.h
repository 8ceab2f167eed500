// An 8-bit gray image as a texture (bilinear reads in hardware, fractions of 8 bits, clamped at the border) and as
// texel quads: the matching cost reads some samples each way, since each way alone is bound by its own unit.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "cuda/buffer.h"
#include "cuda/error.h"
#include "cuda/texel_quads.h"
#include "cuda/texture_sampler.h"
#include "phi/backend.h"

namespace phi::gpu {

// Coordinates are K's: pixel centres at half-integers, as the hardware has them. Values are gray / 255.
class GrayTexture {
 public:
  // The copy is ordered on `stream`; `image` may go away once the constructor has returned.
  GrayTexture(const GrayImage& image, cudaStream_t stream, const Task& task);
  ~GrayTexture();
  GrayTexture(const GrayTexture&) = delete;
  GrayTexture& operator=(const GrayTexture&) = delete;

  cudaTextureObject_t get() const { return texture_; }
  TexelQuads quads() const { return {quads_.data(), QuadPitch(width_)}; }
  std::size_t bytes() const { return bytes_; }

 private:
  cudaArray_t array_ = nullptr;
  cudaTextureObject_t texture_ = 0;
  DeviceBuffer<std::uint32_t> quads_;
  int width_ = 0;
  std::size_t bytes_ = 0;
};

// All levels of an image's pyramid (phi/matching/pyramid.h).
class GrayPyramid {
 public:
  GrayPyramid(const GrayImage& image, cudaStream_t stream, const Task& task);

  // Level 0 first, kMaxPyramidLevels of them.
  void CopyTextures(TextureSampler* textures) const;
  void CopyQuads(const std::uint32_t** quads) const;
  const GrayTexture& level(int level) const { return *levels_[level]; }
  std::size_t bytes() const;

 private:
  std::vector<std::unique_ptr<GrayTexture>> levels_;
};

}  // namespace phi::gpu

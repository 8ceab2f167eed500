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
#include "phi/base/images.h"

namespace phi::gpu {

// kQuads: for speed, 5 bytes a pixel. kCompact: 1 byte a pixel; texel quads are gathered from the texture.
enum class ImageForm { kQuads, kCompact };

// Coordinates are K's: pixel centres at half-integers, as the hardware has them. Values are gray / 255.
class GrayTexture {
 public:
  // The copy is ordered on `stream`; `image` may go away once the constructor has returned.
  GrayTexture(const GrayImage& image, ImageForm form, cudaStream_t stream, const Task& task);
  ~GrayTexture();
  GrayTexture(const GrayTexture&) = delete;
  GrayTexture& operator=(const GrayTexture&) = delete;

  cudaTextureObject_t get() const { return texture_; }
  TexelQuads quads() const { return {quads_.data(), QuadPitch(width_), gather_}; }

  static std::size_t Bytes(int width, int height, ImageForm form);

 private:
  void MakeTextures(const Task& task);
  void Destroy();

  cudaArray_t array_ = nullptr;
  cudaTextureObject_t texture_ = 0;
  cudaTextureObject_t gather_ = 0;     // of kCompact: unfiltered bytes
  DeviceBuffer<std::uint32_t> quads_;  // of kQuads
  int width_ = 0;
};

// All levels of an image's pyramid (phi/matching/pyramid.h).
class GrayPyramid {
 public:
  GrayPyramid(const GrayImage& image, ImageForm form, cudaStream_t stream, const Task& task);

  // From `first_level` on, of kMaxPyramidLevels.
  void CopyTextures(int first_level, TextureSampler* textures) const;
  void CopyQuads(int first_level, TexelQuads* quads) const;
  const GrayTexture& level(int level) const { return *levels_[level]; }

  static std::size_t Bytes(int width, int height, ImageForm form);

 private:
  std::vector<std::unique_ptr<GrayTexture>> levels_;
};

}  // namespace phi::gpu

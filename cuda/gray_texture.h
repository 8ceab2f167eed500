// An 8-bit gray image as a texture: bilinear reads in hardware, fractions of 8 bits, clamped at the border.
#pragma once

#include <cuda_runtime_api.h>

#include <array>
#include <cstddef>

#include "cuda/error.h"
#include "cuda/texture_sampler.h"
#include "phi/base/images.h"
#include "phi/matching/window_level.h"

namespace phi::gpu {

// Coordinates are K's: pixel centres at half-integers, as the hardware has them. Values are gray / 255.
class GrayTexture {
 public:
  GrayTexture() = default;
  GrayTexture(const GrayImage& image, cudaStream_t stream, const Task& task);
  ~GrayTexture();
  GrayTexture(const GrayTexture&) = delete;
  GrayTexture& operator=(const GrayTexture&) = delete;

  // In the place of what was there; the memory stays where the size is the same. Returns once the image is copied.
  void Upload(const GrayImage& image, cudaStream_t stream, const Task& task);

  cudaTextureObject_t get() const { return texture_; }

  static std::size_t Bytes(int width, int height);

 private:
  void Make(int width, int height, const Task& task);
  void Destroy();

  int width_ = 0, height_ = 0;
  cudaArray_t array_ = nullptr;
  cudaTextureObject_t texture_ = 0;
};

// All levels of an image's pyramid (phi/matching/pyramid.h).
class GrayPyramid {
 public:
  GrayPyramid() = default;
  GrayPyramid(const GrayImage& image, cudaStream_t stream, const Task& task) { Upload(image, stream, task); }

  // As GrayTexture.
  void Upload(const GrayImage& image, cudaStream_t stream, const Task& task);

  // From `first_level` on, of kMaxPyramidLevels.
  void CopyTextures(int first_level, TextureSampler* textures) const;
  const GrayTexture& level(int level) const { return levels_[level]; }

  static std::size_t Bytes(int width, int height);

 private:
  std::array<GrayTexture, kMaxPyramidLevels> levels_;
};

}  // namespace phi::gpu

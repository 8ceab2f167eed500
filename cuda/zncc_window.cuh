// Hand-tuned matching cost: ZNCC of a slanted window between the reference and one source texture.
//
// phi/matching holds the readable form; tests/cuda compares the two. What differs here:
//  - the reference window is read once per pixel for all hypotheses and views, and kept in registers as half-precision
//    differences from the window's centre (small where texture is faint, so that rounding is, too);
//  - the homography is centred on the window, so that a sample costs three multiply-adds, one reciprocal and two
//    products; offsets are compile-time multiples of the step;
//  - sums are of differences from the reference's centre value: no cancellation in single precision.
#pragma once

#include <cuda_fp16.h>
#include <cuda_runtime.h>

#include "phi/geometry/device_camera.h"

namespace phi::gpu {

__device__ __forceinline__ float FastReciprocal(float x) {
  float y;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(x));
  return y;
}

// Sums over the samples of one source view's window.
struct SourceSums {
  float s = 0, ss = 0, rs = 0;
};

// kSide: samples per side, odd. Sample (row, column) lies at ((column - kSide / 2) * step, (row - kSide / 2) * step).
template <int kSide>
class ReferenceWindow {
 public:
  static constexpr int kCount = kSide * kSide;

  __device__ __forceinline__ void Load(cudaTextureObject_t texture, float u, float v, float step) {
    centre_ = tex2D<float>(texture, u, v);
    sum_ = 0;
    float squares = 0;
#pragma unroll
    for (int k = 0; k < kCount; k += 2) {
      const float r0 = Read(texture, u, v, step, k);
      const float r1 = k + 1 < kCount ? Read(texture, u, v, step, k + 1) : 0.0f;
      packed_[k / 2] = __floats2half2_rn(r0, r1);
      sum_ += r0 + r1;
      squares = fmaf(r0, r0, fmaf(r1, r1, squares));
    }
    scatter_ = squares - sum_ * sum_ * (1.0f / kCount);
  }

  // n * variance of the reference window, (gray / 255)^2.
  __device__ __forceinline__ float scatter() const { return scatter_; }

  // p0, du, dv: homogeneous source pixel of the window's centre and its change per pixel to the right and down.
  __device__ __forceinline__ SourceSums Accumulate(cudaTextureObject_t texture, Vec3f p0, Vec3f du, Vec3f dv,
                                                   float step) const {
    SourceSums sums;
    du = step * du;
    dv = step * dv;
#pragma unroll
    for (int row = 0; row < kSide; ++row) {
      const float y = static_cast<float>(row - kSide / 2);
      const Vec3f left = {fmaf(y, dv.x, p0.x), fmaf(y, dv.y, p0.y), fmaf(y, dv.z, p0.z)};
#pragma unroll
      for (int column = 0; column < kSide; ++column) {
        const float x = static_cast<float>(column - kSide / 2);
        const float inverse_w = FastReciprocal(fmaf(x, du.z, left.z));
        const float s = tex2D<float>(texture, fmaf(x, du.x, left.x) * inverse_w, fmaf(x, du.y, left.y) * inverse_w) -
                        centre_;
        const int k = row * kSide + column;
        const float r = k % 2 == 0 ? __low2float(packed_[k / 2]) : __high2float(packed_[k / 2]);
        sums.s += s;
        sums.ss = fmaf(s, s, sums.ss);
        sums.rs = fmaf(r, s, sums.rs);
      }
    }
    return sums;
  }

  // n * variance of the source window and n * covariance with the reference.
  __device__ __forceinline__ float SourceScatter(const SourceSums& sums) const {
    return sums.ss - sums.s * sums.s * (1.0f / kCount);
  }
  __device__ __forceinline__ float Covariance(const SourceSums& sums) const {
    return sums.rs - sum_ * sums.s * (1.0f / kCount);
  }

 private:
  __device__ __forceinline__ float Read(cudaTextureObject_t texture, float u, float v, float step, int k) const {
    return tex2D<float>(texture, u + step * static_cast<float>(k % kSide - kSide / 2),
                        v + step * static_cast<float>(k / kSide - kSide / 2)) - centre_;
  }

  __half2 packed_[(kCount + 1) / 2];
  float centre_ = 0, sum_ = 0, scatter_ = 0;
};

}  // namespace phi::gpu

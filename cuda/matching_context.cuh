// The view policy of phi/matching/estimate_pixel.h on the GPU, with a hand-tuned matching cost.
//
// phi/matching/zncc.h holds the readable form; tests/cuda compares the two. What differs here:
//  - the reference window is read once per pixel for all hypotheses and views, and kept in shared memory as
//    half-precision differences from the window's centre (small where texture is faint: so is their rounding);
//  - the homography is centred on the window: a sample costs three multiply-adds, one approximate reciprocal, two
//    products, one read of the source and one approximate power of two for the sample's weight;
//  - texture fetches alone would bound the kernel, so every other sample is read as a texel quad by a plain load and
//    interpolated in integers;
//  - sums over the reference are made once.
#pragma once

#include <cuda_fp16.h>

#include "cuda/estimation_kernels.h"
#include "cuda/texel_quads.h"

namespace phi::gpu {

inline constexpr int kThreads = 128;  // of a block: four warps

__device__ __forceinline__ float FastReciprocal(float x) {
  float y;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(x));
  return y;
}

__device__ __forceinline__ float FastExp2(float x) {
  float y;
  asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(x));
  return y;
}

// Pixels along a side of a pyramid level (phi::HalveImage rounds up).
__device__ __forceinline__ int LevelSize(int size, int level) { return (size + (1 << level) - 1) >> level; }

// The texel quad of cell (column, row). The cell's corner lies in the middle of its four texels, so rounding cannot make
// the texture unit take others.
__device__ __forceinline__ std::uint32_t GatherQuad(cudaTextureObject_t texels, std::uint32_t column,
                                                    std::uint32_t row) {
  const uchar4 t = tex2Dgather<uchar4>(texels, __uint2float_rn(column),
                                       __uint2float_rn(row));  // from low left, to the right
  const std::uint32_t top = t.w | static_cast<std::uint32_t>(t.z) << 8;
  const std::uint32_t low = t.x | static_cast<std::uint32_t>(t.y) << 8;
  return top | low << 16;
}

// Grey level at (u, v) = (x, y) / w in K's coordinates, with fractions of 7 bits, less `shift`. Inside the image only.
template <ImageForm kForm>
__device__ __forceinline__ float ReadQuad(const TexelQuads& quads, float x, float y, float inverse_w,
                                          float shift) {
  // Adding 1.5 * 2^16 leaves a fixed-point number of 7 fractional bits in the mantissa; 0.5 more for the cell's index.
  constexpr float kMagic = 98304.5f;
  constexpr std::uint32_t kMagicCell = 0x47C00000u >> 7;
  const std::uint32_t u = __float_as_uint(fmaf(x, inverse_w, kMagic));
  const std::uint32_t v = __float_as_uint(fmaf(y, inverse_w, kMagic));
  std::uint32_t texels;
  if constexpr (kForm == ImageForm::kCompact) {
    texels = GatherQuad(quads.gather, (u >> 7) - kMagicCell, (v >> 7) - kMagicCell);
  } else {
    const std::uint32_t pitch = static_cast<std::uint32_t>(quads.pitch);
    const std::uint32_t row = (v >> 7) * pitch - (kMagicCell * pitch + kMagicCell);  // modulo 2^32
    texels = __ldg(quads.data + (row + (u >> 7)));
  }
  const std::uint32_t fraction_u = u & 127, fraction_v = v & 127;
  // Two 16-bit weights in a word: left in the lower half, right in the upper one.
  const std::uint32_t weights = fraction_u * 65535u + 128u;
  const std::uint32_t top = weights * (128u - fraction_v), bottom = weights * 128u - top;
  // The weights add up to 2^14. Starting at the bits of 2^23 makes the sum the mantissa of 2^23 + sum.
  const std::uint32_t sum = __dp2a_lo(top, texels, __dp2a_hi(bottom, texels, 0x4B000000u));
  return fmaf(__uint_as_float(sum), 1.0f / 16384.0f, -(512.0f + shift));
}

// One level of a source image, read both ways.
struct SourceLevel {
  const TextureSampler& texture;
  TexelQuads quads;

  __device__ __forceinline__ SourceLevel(const SourceView& view, int level)
      : texture(view.textures[level]), quads(view.quads[level]) {}
};

// The window's centre in a source image in homogeneous pixels, and its change per sample to the right and down.
struct WindowWarp {
  Vec3f centre, right, down;

  // (u, v), q, step: pixels of the full image. `scale`: 2^-level; the warp ends in that level's pixels.
  __device__ __forceinline__ WindowWarp(const SourceView& view, float u, float v, Vec3f q,
                                        float inverse_depth, float step, float scale) {
    centre = InLevel(view.a * Vec3f{u, v, 1.0f} + inverse_depth * view.b, scale);
    const float* a = view.a.m;
    right = InLevel(step * (Vec3f{a[0], a[3], a[6]} + q.x * view.b), scale);
    down = InLevel(step * (Vec3f{a[1], a[4], a[7]} + q.y * view.b), scale);
  }

  __device__ __forceinline__ static Vec3f InLevel(Vec3f p, float scale) {
    return {scale * p.x, scale * p.y, p.z};
  }

  // phi::WindowIsInside without divisions.
  __device__ __forceinline__ bool IsInside(float samples_per_side, const SourceView& view, int level) const {
    const float right_limit = LevelSize(view.width, level) - 0.5f,
                low_limit = LevelSize(view.height, level) - 0.5f;
    bool inside = true;
#pragma unroll
    for (int corner = 0; corner < 4; ++corner) {
      const Vec3f p = centre + (corner & 1 ? samples_per_side : -samples_per_side) * right +
                      (corner & 2 ? samples_per_side : -samples_per_side) * down;
      inside = inside && p.z > 0 && p.x >= 0.5f * p.z && p.y >= 0.5f * p.z && p.x <= right_limit * p.z &&
               p.y <= low_limit * p.z;
    }
    return inside;
  }
};

// Reference samples of each thread's window. kSide: samples on a side of the window, odd; or 0 for any window, whose
// samples are then read again for each hypothesis and view.
template <int kSide, ImageForm kForm>
class ReferenceWindow {
 public:
  static constexpr int kPairs = (kSide + 1) / 2;  // of samples in a row
  // Row and column of the first sparse sample: even offsets from the centre.
  static constexpr int kFirstSparse = kSide / 2 % 2;
  static constexpr int kSharedBytes = kSide * kPairs * kThreads * static_cast<int>(sizeof(__half2));

  __device__ __forceinline__ void Load(TextureSampler texture, const MatchingWindow& window, float u,
                                       float v) {
    shift_ = texture(u, v);
    weight_decay_ = window.weight_decay;
#pragma unroll 1
    for (int row = 0; row < kSide; ++row) {
      const float y = v + (row - kSide / 2) * window.step;
#pragma unroll
      for (int pair = 0; pair < kPairs; ++pair) {
        const int column = 2 * pair - kSide / 2;
        const float r0 = texture(u + column * window.step, y) - shift_;
        const float r1 = 2 * pair + 1 < kSide ? texture(u + (column + 1) * window.step, y) - shift_ : 0.0f;
        const __half2 packed = __floats2half2_rn(r0, r1);
        const float2 r = __half22float2(packed);
        const float w0 = Weight(r.x), w1 = 2 * pair + 1 < kSide ? Weight(r.y) : 0.0f;
        total_weight_ += w0 + w1;
        sums_.r += w0 * r.x + w1 * r.y;
        sums_.rr = fmaf(w0 * r.x, r.x, fmaf(w1 * r.y, r.y, sums_.rr));
        if (row % 2 == kFirstSparse) {
          const float w_sparse = kFirstSparse ? w1 : w0, r_sparse = kFirstSparse ? r.y : r.x;
          sparse_weight_ += w_sparse;
          sparse_sums_.r += w_sparse * r_sparse;
          sparse_sums_.rr = fmaf(w_sparse * r_sparse, r_sparse, sparse_sums_.rr);
        }
        SharedSamples()[(row * kPairs + pair) * kThreads] = packed;
      }
    }
  }

  __device__ __forceinline__ float Cost(const SourceLevel& source, const WindowWarp& warp, Samples samples) const {
    return samples == Samples::kSparse ? SparseSums(source, warp).Cost(sparse_weight_)
                                       : Sums(source, warp).Cost(total_weight_);
  }

 private:
  __device__ __forceinline__ ZnccSums Sums(const SourceLevel& source, const WindowWarp& warp) const {
    ZnccSums sums = sums_;
    const float half = static_cast<float>(kSide / 2);
    Vec3f middle = warp.centre - half * warp.down;
#pragma unroll 1
    for (int row = 0; row < kSide; ++row) {
#pragma unroll
      for (int pair = 0; pair < kPairs; ++pair) {
        const float2 r = __half22float2(SharedSamples()[(row * kPairs + pair) * kThreads]);
        Add<false>(source, warp, middle, static_cast<float>(2 * pair - kSide / 2), r.x, &sums);
        if (2 * pair + 1 < kSide) {
          Add<true>(source, warp, middle, static_cast<float>(2 * pair + 1 - kSide / 2), r.y, &sums);
        }
      }
      middle = middle + warp.down;
    }
    return sums;
  }

  __device__ __forceinline__ ZnccSums SparseSums(const SourceLevel& source, const WindowWarp& warp) const {
    ZnccSums sums = sparse_sums_;
    Vec3f middle = warp.centre - static_cast<float>(kSide / 2 - kFirstSparse) * warp.down;
#pragma unroll 1
    for (int row = kFirstSparse; row < kSide; row += 2) {
#pragma unroll
      for (int pair = 0; 2 * pair + kFirstSparse < kSide; ++pair) {
        const __half2 packed = SharedSamples()[(row * kPairs + pair) * kThreads];
        const float r = kFirstSparse ? __high2float(packed) : __low2float(packed);
        const float column = static_cast<float>(2 * pair + kFirstSparse - kSide / 2);
        if (pair % 2 == 0) {
          Add<false>(source, warp, middle, column, r, &sums);
        } else {
          Add<true>(source, warp, middle, column, r, &sums);
        }
      }
      middle = middle + 2.0f * warp.down;
    }
    return sums;
  }

  __device__ __forceinline__ static __half2* SharedSamples() {
    extern __shared__ __half2 reference_samples[];
    return reference_samples + threadIdx.x;
  }

  template <bool kByTexture>
  __device__ __forceinline__ void Add(const SourceLevel& source, const WindowWarp& warp, Vec3f middle,
                                      float column, float r, ZnccSums* sums) const {
    const float x = fmaf(column, warp.right.x, middle.x), y = fmaf(column, warp.right.y, middle.y);
    const float inverse_w = FastReciprocal(fmaf(column, warp.right.z, middle.z));
    const float s =
        kByTexture ? fmaf(255.0f, tex2D<float>(source.texture.texture, x * inverse_w, y * inverse_w), -shift_)
                   : ReadQuad<kForm>(source.quads, x, y, inverse_w, shift_);
    const float weighted = Weight(r) * s;
    sums->s += weighted;
    sums->ss = fmaf(weighted, s, sums->ss);
    sums->rs = fmaf(weighted, r, sums->rs);
  }

  // MatchingWindow::Weight. Computed anew for each source: cheaper than keeping it beside the sample.
  __device__ __forceinline__ float Weight(float difference) const {
    return FastExp2(-weight_decay_ * difference * difference);
  }

  float shift_ = 0;
  float weight_decay_ = 0, total_weight_ = 0;
  ZnccSums sums_;  // of the reference; those of the source are zero
  float sparse_weight_ = 0;
  ZnccSums sparse_sums_;
};

template <ImageForm kForm>
class ReferenceWindow<0, kForm> {
 public:
  static constexpr int kSharedBytes = 0;

  __device__ __forceinline__ void Load(TextureSampler texture, const MatchingWindow& window, float u,
                                       float v) {
    texture_ = texture;
    window_ = window;
    u_ = u;
    v_ = v;
    shift_ = texture(u, v);
  }

  __device__ __forceinline__ float Cost(const SourceLevel& source, const WindowWarp& warp, Samples samples) const {
    ZnccSums sums;
    float total_weight = 0;
    const int step = samples == Samples::kSparse ? 2 : 1;
    const int n = window_.samples_per_side / step * step;
#pragma unroll 1
    for (int row = -n; row <= n; row += step) {
#pragma unroll 4
      for (int column = -n; column <= n; column += step) {
        const Vec3f p =
            warp.centre + static_cast<float>(row) * warp.down + static_cast<float>(column) * warp.right;
        const float inverse_w = FastReciprocal(p.z);
        const float r = texture_(u_ + column * window_.step, v_ + row * window_.step) - shift_;
        const float s = source.texture(p.x * inverse_w, p.y * inverse_w) - shift_;
        const float w = window_.Weight(r), weighted = w * s;
        total_weight += w;
        sums.r += w * r;
        sums.rr = fmaf(w * r, r, sums.rr);
        sums.s += weighted;
        sums.ss = fmaf(weighted, s, sums.ss);
        sums.rs = fmaf(weighted, r, sums.rs);
      }
    }
    return sums.Cost(total_weight);
  }

 private:
  TextureSampler texture_;
  MatchingWindow window_;
  float u_ = 0, v_ = 0, shift_ = 0;
};

template <int kSide, ImageForm kForm>
struct GpuContext {
  const EstimationLaunch& launch;
  const EstimationParameters& parameters;
  EstimationState state;
  mutable std::uint32_t num_samples = 0;  // of the sources, that this thread read

  struct Patch {
    ReferenceWindow<kSide, kForm> window;
    float step;          // between the window's samples, pixels of its level
    unsigned level_bit;  // 1 << level of the pyramids, see phi/matching/window_level.h
  };

  __device__ __forceinline__ explicit GpuContext(const EstimationLaunch& l)
      : launch(l), parameters(l.parameters), state(l.state) {}

  __device__ __forceinline__ Patch LoadPatch(int x, int y) const {
    Patch patch;
    patch.level_bit = launch.window_scales(x, y);
    const WindowScale scale_of_window = UnpackWindowScale(static_cast<std::uint8_t>(patch.level_bit));
    const MatchingWindow window = WindowAtScale(parameters.window, scale_of_window);
    patch.step = window.step;
    ForLevel(patch.level_bit, [&](int level) {
      const float scale = 1.0f / (1 << level);
      patch.window.Load(launch.reference[level], window, scale * (x + 0.5f), scale * (y + 0.5f));
    });
    return patch;
  }

  __device__ __forceinline__ float Cost(const Patch& patch, int x, int y, const PlaneHypothesis& h, Samples samples) const {
    HarmonicMean mean;
    ForEachView(patch, x, y, h, samples, [&](int, float cost) { mean.Add(cost); });
    return mean.Value();
  }

  // Calls function(view, cost) for each source view in turn.
  template <class Function>
  __device__ __forceinline__ void ForEachView(const Patch& patch, int x, int y, const PlaneHypothesis& h, Samples samples,
                                              const Function& function) const {
    const Vec3f q = InverseDepthCoefficients(parameters.reference, x + 0.5f, y + 0.5f, h);
    ForLevel(patch.level_bit, [&](int level) {
      ForEachViewOnLevel(patch, level, x + 0.5f, y + 0.5f, h, q, samples, function);
    });
  }

  // Adds what the threads of the warp read to the launch's count. All of them must call it.
  __device__ __forceinline__ void CountSamples() const {
    constexpr unsigned kWarp = 0xffffffffu;
    std::uint32_t sum = num_samples;
    for (int offset = 16; offset > 0; offset /= 2) sum += __shfl_down_sync(kWarp, sum, offset);
    if ((threadIdx.x & 31) == 0) atomicAdd(launch.num_samples, static_cast<unsigned long long>(sum));
  }

 private:
  // Calls function(level) for the level that the bit stands for. The counter is the same for all threads of a warp, and
  // so is a texture handle that it selects; one selected by a thread's own level would serialise every fetch.
  template <class Function>
  __device__ __forceinline__ void ForLevel(unsigned level_bit, const Function& function) const {
#pragma unroll 1
    for (int level = 0; level < parameters.num_levels; ++level) {
      if (level_bit >> level & 1u) function(level);
    }
  }

  template <class Function>
  __device__ __forceinline__ void ForEachViewOnLevel(const Patch& patch, int level, float u, float v,
                                                     const PlaneHypothesis& h, Vec3f q, Samples samples,
                                                     const Function& function) const {
    const MatchingWindow& form = parameters.window;
    const int num_window_samples = samples == Samples::kSparse ? form.NumSparseSamples() : form.NumSamples();
    const float inverse_depth = 1.0f / h.depth;
    const float pixels = 1 << level, scale = 1.0f / pixels;
#pragma unroll 1
    for (int j = 0; j < parameters.num_views; ++j) {
      const SourceView& view = launch.sources[j];
      const WindowWarp warp(view, u, v, q, inverse_depth, pixels * patch.step, scale);
      const bool is_inside =
          warp.IsInside(static_cast<float>(form.samples_per_side), view, level);
      num_samples += is_inside ? num_window_samples : 0;
      float cost = is_inside ? patch.window.Cost(SourceLevel(view, level), warp, samples) : kMaxCost;
      if (launch.guidance != nullptr) {
        const GuidanceSource& source = launch.guidance[j];
        cost = fminf(cost + GuidanceCost(parameters.reference, source.view, source.depths, u, v, h.depth),
                     kMaxCost);
      }
      function(j, cost);
    }
  }
};

}  // namespace phi::gpu

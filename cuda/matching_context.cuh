// The view policy of phi/matching/estimate_pixel.h on the GPU, with a hand-tuned matching cost.
//
// phi/matching/zncc.h holds the readable form; tests/cuda compares the two. What differs here:
//  - the reference window is read once per pixel and kernel for all hypotheses and views, and kept in shared memory as
//    half-precision differences from the window's centre (small where texture is faint: so is their rounding);
//  - the homography is centred on the window: a sample costs three multiply-adds, one approximate reciprocal, two
//    products, one read of the source and one approximate power of two for the sample's weight;
//  - sums over the reference are made once.
#pragma once

#include <cuda_fp16.h>

#include "cuda/estimation_kernels.h"

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

// The window's centre in a source image in homogeneous pixels, and its change per sample to the right and down.
struct WindowWarp {
  Vec3f centre, right, down;

  // `at`, q, step: pixels of the full image. `scale`: 2^-level; the warp ends in that level's pixels.
  __device__ __forceinline__ WindowWarp(const SourceView& view, ImagePoint at, Vec3f q, float inverse_depth, float step,
                                        float scale) {
    centre = InLevel(view.a * Vec3f{at.u, at.v, 1.0f} + inverse_depth * view.b, scale);
    const float* a = view.a.m;
    right = InLevel(step * (Vec3f{a[0], a[3], a[6]} + q.x * view.b), scale);
    down = InLevel(step * (Vec3f{a[1], a[4], a[7]} + q.y * view.b), scale);
  }

  __device__ __forceinline__ static Vec3f InLevel(Vec3f p, float scale) {
    return {scale * p.x, scale * p.y, p.z};
  }

  // phi::WindowIsInside without divisions or corners: what is linear in the place is least at a corner, by the sizes of its changes
  // to the right and down less than in the middle.
  __device__ __forceinline__ bool IsInside(float samples_per_side, const SourceView& view, int level) const {
    const float right_limit = LevelSize(view.width, level) - 0.5f,
                low_limit = LevelSize(view.height, level) - 0.5f;
    const auto least = [&](auto linear) {
      return linear(centre) - samples_per_side * (fabsf(linear(right)) + fabsf(linear(down)));
    };
    const float depth = least([](Vec3f p) { return p.z; });
    const float margin = fminf(fminf(least([](Vec3f p) { return p.x - 0.5f * p.z; }),
                                     least([](Vec3f p) { return p.y - 0.5f * p.z; })),
                               fminf(least([&](Vec3f p) { return right_limit * p.z - p.x; }),
                                     least([&](Vec3f p) { return low_limit * p.z - p.y; })));
    return depth > 0 && margin >= 0;
  }
};

// Reference samples of the windows of a block's pixels, one a thread; any thread may ask for the cost of any of them. kSide: samples on
// a side of the window, odd; or 0 for any window, whose samples are then read again for each hypothesis and view.
template <int kSide, Samples kSamples>
class ReferenceWindow {
  static constexpr int kCount = kSamples == Samples::kSparse ? kSparseSide : kSide;  // on a side
  static constexpr int kPairs = (kCount + 1) / 2;                                    // of samples in a row
  static constexpr bool kHasCentreApart = kSamples == Samples::kSparse;              // from the rows

 public:
  static constexpr int kSharedBytes = kCount * kPairs * kThreads * static_cast<int>(sizeof(__half2));

  // Of the thread's own pixel.
  __device__ __forceinline__ void Load(TextureSampler texture, const MatchingWindow& window, float u,
                                       float v) {
    slot_ = threadIdx.x;
    shift_ = texture(u, v);
    weight_decay_ = window.weight_decay;
    float total_weight = 0, sum = 0, squares = 0;
#pragma unroll 1
    for (int row = 0; row < kCount; ++row) {
      const float y = v + Offset(row) * window.step;
#pragma unroll
      for (int pair = 0; pair < kPairs; ++pair) {
        const bool has_second = 2 * pair + 1 < kCount;
        const float r0 = texture(u + Offset(2 * pair) * window.step, y) - shift_;
        const float r1 = has_second ? texture(u + Offset(2 * pair + 1) * window.step, y) - shift_ : 0.0f;
        const __half2 packed = __floats2half2_rn(r0, r1);
        const float2 r = __half22float2(packed);
        const float w0 = Weight(r.x), w1 = has_second ? Weight(r.y) : 0.0f;
        total_weight += w0 + w1;
        sum += w0 * r.x + w1 * r.y;
        squares = fmaf(w0 * r.x, r.x, fmaf(w1 * r.y, r.y, squares));
        SharedSamples()[(row * kPairs + pair) * kThreads] = packed;
      }
    }
    if (kHasCentreApart) total_weight += 1;  // less itself it is 0
    inverse_weight_ = 1.0f / total_weight;
    mean_ = sum * inverse_weight_;
    const float variance = fmaf(-sum, mean_, squares) * inverse_weight_;
    inverse_deviation_ = variance >= kMinVariance ? rsqrtf(variance) : 0.0f;
  }

  __device__ __forceinline__ float Cost(TextureSampler source, const WindowWarp& warp) const {
    SourceSums sums;
#pragma unroll 1
    for (int row = 0; row < kCount; ++row) {
      const Vec3f middle = warp.centre + static_cast<float>(Offset(row)) * warp.down;
#pragma unroll
      for (int pair = 0; pair < kPairs; ++pair) {
        const float2 r = __half22float2(SharedSamples()[(row * kPairs + pair) * kThreads]);
        Add(source, warp, middle, static_cast<float>(Offset(2 * pair)), r.x, &sums);
        if (2 * pair + 1 < kCount) Add(source, warp, middle, static_cast<float>(Offset(2 * pair + 1)), r.y, &sums);
      }
    }
    if (kHasCentreApart) Add(source, warp, warp.centre, 0, 0, &sums);
    return CostOf(sums);
  }

 private:
  struct SourceSums {
    float s = 0, ss = 0, rs = 0;
  };

  // ZnccSums::Cost, what depends on the reference alone worked out before.
  __device__ __forceinline__ float CostOf(const SourceSums& sums) const {
    const float variance = fmaf(-sums.s * inverse_weight_, sums.s, sums.ss) * inverse_weight_;
    if (!(inverse_deviation_ > 0) || !(variance >= kMinVariance)) return kMaxCost;
    const float covariance = fmaf(-mean_, sums.s, sums.rs) * inverse_weight_;
    return Clamp(1.0f - covariance * inverse_deviation_ * rsqrtf(variance), 0.0f, kMaxCost);
  }

  // Of row or column i from the centre, in samples of the whole window.
  __device__ __forceinline__ static constexpr int Offset(int i) {
    return kSamples == Samples::kSparse ? SparseOffset(i, kSide / 2) : i - kSide / 2;
  }

  // Of a window, one a thread: threads of a warp read different banks, whichever windows they work on.
  __device__ __forceinline__ __half2* SharedSamples() const {
    extern __shared__ __half2 reference_samples[];
    return reference_samples + slot_;
  }

  __device__ __forceinline__ void Add(TextureSampler source, const WindowWarp& warp, Vec3f middle, float column, float r,
                                      SourceSums* sums) const {
    const float x = fmaf(column, warp.right.x, middle.x), y = fmaf(column, warp.right.y, middle.y);
    const float inverse_w = FastReciprocal(fmaf(column, warp.right.z, middle.z));
    const float s = fmaf(255.0f, tex2D<float>(source.texture, x * inverse_w, y * inverse_w), -shift_);
    const float weighted = Weight(r) * s;
    sums->s += weighted;
    sums->ss = fmaf(weighted, s, sums->ss);
    sums->rs = fmaf(weighted, r, sums->rs);
  }

  // MatchingWindow::Weight. Computed anew for each source: cheaper than keeping it beside the sample.
  __device__ __forceinline__ float Weight(float difference) const {
    return FastExp2(-weight_decay_ * difference * difference);
  }

  int slot_;
  float shift_, weight_decay_;
  float inverse_weight_, mean_, inverse_deviation_;  // of the reference's samples; 0: they have no texture
};

template <Samples kSamples>
class ReferenceWindow<0, kSamples> {
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

  __device__ __forceinline__ float Cost(TextureSampler source, const WindowWarp& warp) const {
    ZnccSums sums;
    float total_weight = 0;
    const auto add = [&](int row, int column) {
      const Vec3f p =
          warp.centre + static_cast<float>(row) * warp.down + static_cast<float>(column) * warp.right;
      const float inverse_w = FastReciprocal(p.z);
      const float r = texture_(u_ + column * window_.step, v_ + row * window_.step) - shift_;
      const float s = source(p.x * inverse_w, p.y * inverse_w) - shift_;
      const float w = window_.Weight(r), weighted = w * s;
      total_weight += w;
      sums.r += w * r;
      sums.rr = fmaf(w * r, r, sums.rr);
      sums.s += weighted;
      sums.ss = fmaf(weighted, s, sums.ss);
      sums.rs = fmaf(weighted, r, sums.rs);
    };
    constexpr bool kIsSparse = kSamples == Samples::kSparse;
    const int n = window_.samples_per_side, count = kIsSparse ? kSparseSide : 2 * n + 1;
    const auto offset = [n](int i) { return kIsSparse ? SparseOffset(i, n) : i - n; };
#pragma unroll 1
    for (int i = 0; i < count; ++i) {
#pragma unroll 4
      for (int j = 0; j < count; ++j) add(offset(i), offset(j));
    }
    if (kIsSparse) add(0, 0);
    return sums.Cost(total_weight);
  }

 private:
  TextureSampler texture_;
  MatchingWindow window_;
  float u_, v_, shift_;
};

// kSamples: those that its costs are made of.
template <int kSide, Samples kSamples>
struct GpuContext {
  const EstimationLaunch& launch;
  const EstimationParameters& parameters;
  EstimationState state;
  mutable std::uint32_t num_samples = 0;  // of the sources, that this thread read

  struct Patch {
    ReferenceWindow<kSide, kSamples> window;
    float step;          // between the window's samples, pixels of its level
    unsigned level_bit;  // 1 << level of the pyramids, see phi/matching/window_level.h
  };

  __device__ __forceinline__ explicit GpuContext(const EstimationLaunch& l)
      : launch(l), parameters(l.parameters), state(l.state) {}

  __device__ __forceinline__ bool BestInSector(int x, int y, int sector, PixelOffset* best) const {
    return phi::BestInSector(state.cost, x, y, sector, best);
  }

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

  __device__ __forceinline__ float Cost(const Patch& patch, int x, int y, const PlaneHypothesis& h, Samples = kSamples) const {
    CostOfViews combined(parameters.view_mean);
    ForEachView(patch, x, y, h, [&](int, float cost) { combined.Add(cost); });
    return combined.Value();
  }

  // Calls function(view, cost) for each source view in turn.
  template <class Function>
  __device__ __forceinline__ void ForEachView(const Patch& patch, int x, int y, const PlaneHypothesis& h,
                                              const Function& function) const {
    const ImagePoint at = {x + 0.5f, y + 0.5f};
    const Vec3f q = InverseDepthCoefficients(parameters.reference, at.u, at.v, h);
    ForLevel(patch.level_bit, [&](int level) { ForEachViewOnLevel(patch, level, at, h, q, function); });
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
  __device__ __forceinline__ void ForEachViewOnLevel(const Patch& patch, int level, ImagePoint at, const PlaneHypothesis& h,
                                                     Vec3f q, const Function& function) const {
    const MatchingWindow& form = parameters.window;
    const int num_window_samples = kSamples == Samples::kSparse ? kNumSparseSamples : form.NumSamples();
    const float inverse_depth = 1.0f / h.depth;
    const float pixels = 1 << level, scale = 1.0f / pixels;
#pragma unroll 1
    for (int j = 0; j < parameters.num_views; ++j) {
      const SourceView& view = launch.sources[j];
      const WindowWarp warp(view, at, q, inverse_depth, pixels * patch.step, scale);
      const bool is_inside =
          warp.IsInside(static_cast<float>(form.samples_per_side), view, level);
      num_samples += is_inside ? num_window_samples : 0;
      function(j, is_inside ? patch.window.Cost(view.textures[level], warp) : kMaxCost);
    }
  }
};

}  // namespace phi::gpu

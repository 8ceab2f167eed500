// FillScanline of phi/inference/line_hypothesis.h by a warp, 32 positions at a time: one thread a scanline waits for memory at each
// position. From the scanline's end on, so that where a gap begins its end is known; the lanes at which gaps begin find their lines side
// by side.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>
#include <type_traits>

#include "phi/inference/line_hypothesis.h"

namespace phi::gpu {

inline constexpr int kWarp = 32;
inline constexpr unsigned kAllLanes = 0xFFFFFFFF;

// The lane's value. By all lanes.
template <typename T>
__device__ T OfLane(const T& value, int lane) {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(int) == 0);
  constexpr int kWords = sizeof(T) / sizeof(int);
  int words[kWords];
  __builtin_memcpy(words, &value, sizeof(T));
#pragma unroll
  for (int& word : words) word = __shfl_sync(kAllLanes, word, lane);
  T result;
  __builtin_memcpy(&result, words, sizeof(T));
  return result;
}

struct WarpGap {
  int begin = 0, end = 0;  // empty: no gap, or the whole scanline
  GapModel model;
};

class WarpScanline {
 public:
  __device__ WarpScanline(const Scanline& line, ArrayView2D<const float> anchors, ArrayView2D<const std::uint8_t> limits,
                          const LineOptions& options, ArrayView2D<float> hypothesis)
      : line_(line), anchors_(anchors), limits_(limits), options_(options), hypothesis_(hypothesis), lane_(threadIdx.x % kWarp) {}

  // By all lanes.
  __device__ void Fill() const {
    int next_anchor = line_.length;  // the first one behind the positions at hand
    for (int first = (line_.length - 1) / kWarp * kWarp; first >= 0; first -= kWarp) {
      const int t = first + lane_;
      const bool is_inside = t < line_.length, has_anchor = is_inside && HasAnchor(t);
      const unsigned with_anchor = __ballot_sync(kAllLanes, has_anchor);
      const bool begins = is_inside && !has_anchor && (t == 0 || HasAnchor(t - 1));
      const unsigned begin_here = __ballot_sync(kAllLanes, begins);
      if (begin_here != 0) FillGaps(first, begin_here, begins ? GapFrom(t, EndFrom(first, with_anchor, next_anchor)) : WarpGap{});
      if (with_anchor != 0) next_anchor = first + __ffs(with_anchor) - 1;
    }
  }

 private:
  __device__ bool HasAnchor(int t) const { return anchors_(line_.x0 + t * line_.dx, line_.y0 + t * line_.dy) > 0; }

  // Of the gap that the lane's position is in.
  __device__ int EndFrom(int first, unsigned with_anchor, int next_anchor) const {
    const unsigned behind = with_anchor & ~((2u << lane_) - 1);
    return behind != 0 ? first + __ffs(behind) - 1 : next_anchor;
  }

  __device__ WarpGap GapFrom(int begin, int end) const {
    if (begin == 0 && end == line_.length) return {};
    return {begin, end, FitGap(line_, anchors_, options_, begin, end)};
  }

  // Those that begin at some of the 32 positions from `first` on; `own`: the lane's, where one does.
  __device__ void FillGaps(int first, unsigned begin_here, const WarpGap& own) const {
    const int t = first + lane_;
    const unsigned before = begin_here & ((2u << lane_) - 1);  // of the lane, and its own
    const WarpGap around = OfLane(own, before != 0 ? kWarp - 1 - __clz(before) : lane_);
    if (before != 0 && t < around.end) FillAt(around, t);
    const WarpGap last = OfLane(own, kWarp - 1 - __clz(begin_here));  // it alone may go on behind them
    for (int s = t + kWarp; s < last.end; s += kWarp) FillAt(last, s);
  }

  __device__ void FillAt(const WarpGap& gap, int t) const {
    FillGapPosition(line_, gap.model, limits_, options_, gap.begin, t, hypothesis_);
  }

  const Scanline line_;
  const ArrayView2D<const float> anchors_;
  const ArrayView2D<const std::uint8_t> limits_;
  const LineOptions& options_;
  const ArrayView2D<float> hypothesis_;
  const int lane_;
};

}  // namespace phi::gpu

// A half-pass in which sparse samples rank (UpdateByRanking in phi/matching/estimate_pixel.h), a kernel a step. In one kernel the code
// that scores a plane would be there four times and outgrow the instruction cache, and a warp would wait for its slowest pixel
// in each step.
#include "cuda/estimation_variants.cuh"
#include "cuda/shared_work.cuh"

namespace phi::gpu {
namespace {

// Of the thread's pixel. A block's pixels have the same order in all kernels.
__device__ __forceinline__ HalfPassNote& NoteOf(const EstimationLaunch& launch, int thread) {
  return launch.notes[(static_cast<std::int64_t>(blockIdx.y) * gridDim.x + blockIdx.x) * kThreads + thread];
}

// Shared memory for one T a thread, whatever T's constructors are.
template <class T>
struct OnePerThread {
  alignas(T) unsigned char bytes[sizeof(T) * kThreads];
  __device__ __forceinline__ T& operator[](int thread) { return reinterpret_cast<T*>(bytes)[thread]; }
};

// The candidates that are scored by all samples. Any thread of the block ranks any pixel's candidate: pixels have one to eight.
template <class V>
__global__ void __launch_bounds__(kThreads)
    RankCandidatesKernel(const __grid_constant__ EstimationLaunch launch, int iteration, int colour) {
  using Context = typename V::Context;
  __shared__ WorkItem order[kThreads], items[kNumSectors * kThreads];
  __shared__ OnePerThread<typename Context::Patch> patches;
  __shared__ char2 offsets[kNumSectors][kThreads];
  __shared__ float costs[kNumSectors][kThreads];
  const Context context(launch);
  const EstimationParameters& p = launch.parameters;
  const TilePixels pixels(launch, colour, order);
  unsigned offered = 0;
  if (pixels.IsMine()) {
    const PixelPosition pixel = pixels.Mine();
    const Candidates candidates = GatherCandidates(context, pixel.x, pixel.y, iteration);
    offered = candidates.offered;
#pragma unroll
    for (int k = 0; k < kNumSectors; ++k) {
      const PixelOffset offset = candidates.offsets[k];
      offsets[k][threadIdx.x] = make_char2(static_cast<signed char>(offset.dx), static_cast<signed char>(offset.dy));
    }
    if (offered != 0) patches[threadIdx.x] = context.LoadPatch(pixel.x, pixel.y);
  }
  const int num_items = ListWork<kNumSectors>(offered, items);
#pragma unroll 1
  for (int i = threadIdx.x; i < num_items; i += kThreads) {
    const int thread = ThreadOf(items[i]), k = NumberOf(items[i]);
    const PixelPosition pixel = pixels.Of(thread);
    const PixelOffset offset = {offsets[k][thread].x, offsets[k][thread].y};
    PlaneHypothesis moved;
    MoveHypothesis(p, launch.state.plane(pixel.x + offset.dx, pixel.y + offset.dy), offset, pixel.x, pixel.y, &moved);
    costs[k][thread] = context.Cost(patches[thread], pixel.x, pixel.y, moved);
  }
  __syncthreads();
  if (pixels.IsMine()) {
    float own[kNumSectors];
#pragma unroll
    for (int k = 0; k < kNumSectors; ++k) own[k] = costs[k][threadIdx.x];
    HalfPassNote note;
#pragma unroll
    for (int i = 0; i < kNumFinalists; ++i) {
      const int k = Cheapest(offered, own);
      const char2 offset = k >= 0 ? offsets[k][threadIdx.x] : make_char2(0, 0);
      note.dx[i] = offset.x;
      note.dy[i] = offset.y;
      if (k >= 0) offered &= ~(1u << k);
    }
    NoteOf(launch, threadIdx.x) = note;
  }
  context.CountSamples();
}

template <class V>
__global__ void __launch_bounds__(kThreads)
    ScoreFinalistsKernel(const __grid_constant__ EstimationLaunch launch, int colour) {
  __shared__ WorkItem order[kThreads];
  const typename V::Context context(launch);
  const TilePixels pixels(launch, colour, order);
  if (pixels.IsMine()) {
    const PixelPosition pixel = pixels.Mine();
    const HalfPassNote note = NoteOf(launch, threadIdx.x);
    ScoredHypothesis best;
    best.cost = launch.state.cost(pixel.x, pixel.y);
    if (note.HasFinalist(0)) {
      const auto patch = context.LoadPatch(pixel.x, pixel.y);
#pragma unroll 1
      for (int i = 0; i < kNumFinalists; ++i) {
        if (!note.HasFinalist(i)) break;
        const PixelOffset offset = {note.dx[i], note.dy[i]};
        PlaneHypothesis moved;
        MoveHypothesis(launch.parameters, launch.state.plane(pixel.x + offset.dx, pixel.y + offset.dy), offset, pixel.x,
                       pixel.y, &moved);
        const float cost = context.Cost(patch, pixel.x, pixel.y, moved);
        if (cost < best.cost) best = {moved, cost};
      }
    }
    WriteBetter(launch.state, pixel.x, pixel.y, best);
  }
  context.CountSamples();
}

template <class V>
__global__ void __launch_bounds__(kThreads)
    RankVariantsKernel(const __grid_constant__ EstimationLaunch launch, int iteration, int colour) {
  __shared__ WorkItem order[kThreads];
  const typename V::Context context(launch);
  const TilePixels pixels(launch, colour, order);
  if (pixels.IsMine()) {
    const PixelPosition pixel = pixels.Mine();
    const auto patch = context.LoadPatch(pixel.x, pixel.y);
    const PlaneHypothesis current = launch.state.plane(pixel.x, pixel.y);
    const PlaneHypothesis disturbed =
        Disturbed(launch.parameters, launch.state, current, pixel.x, pixel.y, iteration);
    float lowest = 0;
    int promising = 0;
#pragma unroll 1
    for (int variant = 0; variant <= kNumVariants; ++variant) {
      const PlaneHypothesis h = RefinementVariant(current, disturbed, variant);
      const float cost = context.Cost(patch, pixel.x, pixel.y, h);
      if (variant > 0 && !(cost < lowest)) continue;
      lowest = cost;
      promising = variant;
    }
    NoteOf(launch, threadIdx.x).promising = static_cast<std::uint8_t>(promising);
  }
  context.CountSamples();
}

// By as few warps as have something to do.
template <class V>
__global__ void __launch_bounds__(kThreads)
    ScoreVariantKernel(const __grid_constant__ EstimationLaunch launch, int iteration, int colour) {
  __shared__ WorkItem order[kThreads], items[kThreads];
  const typename V::Context context(launch);
  const TilePixels pixels(launch, colour, order);
  const bool is_wanted = pixels.IsMine() && NoteOf(launch, threadIdx.x).promising > 0;
  const int num_items = ListWork<1>(is_wanted ? 1 : 0, items);
  if (static_cast<int>(threadIdx.x) < num_items) {
    const int thread = ThreadOf(items[threadIdx.x]);
    const PixelPosition pixel = pixels.Of(thread);
    const PlaneHypothesis current = launch.state.plane(pixel.x, pixel.y);
    const PlaneHypothesis disturbed =
        Disturbed(launch.parameters, launch.state, current, pixel.x, pixel.y, iteration);
    const PlaneHypothesis h = RefinementVariant(current, disturbed, NoteOf(launch, thread).promising);
    const float cost = context.Cost(context.LoadPatch(pixel.x, pixel.y), pixel.x, pixel.y, h);
    if (cost < launch.state.cost(pixel.x, pixel.y)) WriteState(launch.state, pixel.x, pixel.y, h, cost);
  }
  context.CountSamples();
}

}  // namespace

void LaunchRankedHalfPass(const EstimationLaunch& launch, int iteration, int colour, cudaStream_t stream,
                          const Task& task) {
  WithVariant<Samples::kSparse>(launch, [&](auto variant) {
    using V = decltype(variant);
    LaunchVariant<V>("RankCandidatesKernel", RankCandidatesKernel<V>, launch, stream, task, iteration, colour);
  });
  WithVariant<Samples::kAll>(launch, [&](auto variant) {
    using V = decltype(variant);
    LaunchVariant<V>("ScoreFinalistsKernel", ScoreFinalistsKernel<V>, launch, stream, task, colour);
  });
  WithVariant<Samples::kSparse>(launch, [&](auto variant) {
    using V = decltype(variant);
    LaunchVariant<V>("RankVariantsKernel", RankVariantsKernel<V>, launch, stream, task, iteration, colour);
  });
  WithVariant<Samples::kAll>(launch, [&](auto variant) {
    using V = decltype(variant);
    LaunchVariant<V>("ScoreVariantKernel", ScoreVariantKernel<V>, launch, stream, task, iteration, colour);
  });
}

}  // namespace phi::gpu

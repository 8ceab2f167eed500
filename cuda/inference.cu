#include "cuda/inference_kernels.h"
#include "phi/inference/hypothesis_cost.h"
#include "phi/inference/plane_normal.h"

namespace phi::gpu {

HypothesisMaps InferenceLaunch::Maps() const {
  HypothesisMaps maps;
  for (int k = 0; k < kNumDirections; ++k) maps.inverse_depth[k] = hypotheses[k];
  return maps;
}

namespace {

const dim3 kBlock(32, 4);

dim3 Grid(int width, int height) {
  return dim3((width + kBlock.x - 1) / kBlock.x, (height + kBlock.y - 1) / kBlock.y);
}

__device__ __forceinline__ int ThreadX() { return blockIdx.x * blockDim.x + threadIdx.x; }
__device__ __forceinline__ int ThreadY() { return blockIdx.y * blockDim.y + threadIdx.y; }

__global__ void InverseDepthKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.measured.Contains(x, y)) return;
  const PixelState state = launch.states(x, y);
  const float w = CarriesPlanes(state) ? 1 / launch.measured(x, y).depth : 0;
  const float evidence = IsEvidence(state) ? w : 0;
  launch.measured_inverse_depth(x, y) = evidence;
  launch.supporting(x, y) = launch.formulas == Formulas::kRobust ? w : evidence;
}

__global__ void SupportKernel(const __grid_constant__ InferenceLaunch launch, LineOptions options) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.supports.Contains(x, y)) return;
  const Support support = MakeSupport(launch.supporting, x, y, options);
  launch.supports(x, y) = support;
  launch.support_values(x, y) = support.value;
  const float start = StartHypothesis(launch.measured_inverse_depth(x, y), support);
  for (int k = 0; k < kNumDirections; ++k) launch.hypotheses[k](x, y) = start;
}

// One thread a scanline; blockIdx.y is the direction.
__global__ void ScanlineKernel(const __grid_constant__ InferenceLaunch launch, LineOptions options) {
  const int direction = blockIdx.y, width = launch.supports.width, height = launch.supports.height;
  const int index = ThreadX();
  if (index >= NumScanlines(direction, width, height)) return;
  FillScanline(MakeScanline(direction, index, width, height), launch.supports, options,
               launch.hypotheses[direction]);
}

// As Hypotheses::ReplaceDiagonals and RemoveOverexposed.
__global__ void RegionPlaneKernel(const __grid_constant__ InferenceLaunch launch) {
  constexpr int kReplaced[kRegionMaps] = {kDescending, kAscending};
  constexpr float kOverexposed = 250;
  const int x = ThreadX(), y = ThreadY();
  if (!launch.supports.Contains(x, y)) return;
  launch.from_region(x, y) = 0;
  if (launch.measured_inverse_depth(x, y) > 0) return;
  if (launch.reference_texture(x + 0.5f, y + 0.5f) > kOverexposed - 0.5f) {
    for (int k = 0; k < kNumDirections; ++k) launch.hypotheses[k](x, y) = 0;
    return;
  }
  for (int k = 0; k < kRegionMaps; ++k) {
    const float w = launch.region_planes[k](x, y);
    if (!(w > 0)) continue;
    launch.hypotheses[kReplaced[k]](x, y) = w;
    launch.from_region(x, y) |= static_cast<std::uint8_t>(1 << kReplaced[k]);
  }
}

// As HypothesisMatcher::Evidence.
__device__ DepthEvidence Evidence(const InferenceLaunch& launch, int x, int y, float inverse_depth) {
  DepthEvidence evidence;
  for (int j = 0; j < launch.num_sources; ++j) {
    AddEvidence(launch.sources[j].view, launch.sources[j].measured, x + 0.5f, y + 0.5f, inverse_depth,
                &evidence);
  }
  return evidence;
}

// As HypothesisMatcher::Cost.
__device__ float HypothesisCost(const InferenceLaunch& launch, int x, int y, int k) {
  float view_costs[kMaxSourceViews];
  for (int j = 0; j < launch.num_sources; ++j) {
    view_costs[j] = HypothesisViewCost(launch.reference_texture, launch.sources[j].texture,
                                       launch.sources[j].view, launch.window, launch.hypotheses[k], x, y);
  }
  return launch.formulas == Formulas::kPaper ? HarmonicMeanCost(view_costs, launch.num_sources)
                                             : BestMatchesCost(view_costs, launch.num_sources);
}

// As HypothesisMatcher::Costs.
__device__ PixelHypotheses HypothesisCosts(const InferenceLaunch& launch, int x, int y) {
  PixelHypotheses result;
  for (int k = 0; k < kNumDirections; ++k) {
    const float w = launch.hypotheses[k](x, y);
    if (!(w > 0)) continue;
    result.offered |= static_cast<std::uint8_t>(1 << k);
    if (launch.formulas == Formulas::kRobust && Evidence(launch, x, y, w).SeenThrough()) continue;
    result.unobstructed |= static_cast<std::uint8_t>(1 << k);
    result.cost[k] = HypothesisCost(launch, x, y, k);
  }
  result.allowed = result.unobstructed;
  if (launch.formulas == Formulas::kRobust && result.unobstructed != 0) {
    RefuseMismatches(launch.reference_texture, launch.window, x, y, &result);
    PreferRegionPlanes(launch.from_region(x, y), &result);
  }
  return result;
}

__global__ void MinCostKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.inferred.Contains(x, y)) return;
  float chosen = 0;
  if (!(launch.measured_inverse_depth(x, y) > 0)) {
    const int best = HypothesisCosts(launch, x, y).Cheapest();
    if (best >= 0) chosen = launch.hypotheses[best](x, y);
  }
  launch.inferred(x, y) = chosen;
}

__global__ void MeasuredNodeKernel(const __grid_constant__ InferenceLaunch launch,
                                   ArrayView2D<float> measured) {
  const int i = ThreadX(), j = ThreadY();
  if (measured.Contains(i, j))
    measured(i, j) = launch.measured_inverse_depth(kFieldStride * i, kFieldStride * j);
}

__device__ void CountOne(const FieldLaunch& field, FieldTotal total) {
  atomicAdd(reinterpret_cast<unsigned long long*>(field.totals + total), 1ull);
}

// As Field's constructor and AddNode. Reads the neighbours' measured depths, which MeasuredNodeKernel has written.
__global__ void NodeKernel(const __grid_constant__ InferenceLaunch launch,
                           const __grid_constant__ FieldLaunch field) {
  constexpr int kOffsets[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
  const int i = ThreadX(), j = ThreadY();
  if (!field.measured.Contains(i, j)) return;
  const int x = kFieldStride * i, y = kFieldStride * j;
  const std::int64_t node = NodeIndex(field.view, i, j);
  const PixelHypotheses pixel = field.measured(i, j) > 0 ? PixelHypotheses() : HypothesisCosts(launch, x, y);
  field.allowed[node] = pixel.allowed;
  field.chosen(i, j) = pixel.AllRefused() ? kRefusedNode : field.measured(i, j);
  if (!(field.measured(i, j) > 0)) {
    if (pixel.offered == 0) CountOne(field, kWithoutHypothesis);
    if (pixel.AllSeenThrough()) CountOne(field, kSeenThrough);
    if (pixel.AllMismatched()) CountOne(field, kMismatched);
  }
  for (int k = 0; k < kNumDirections; ++k) {
    float w = 0;
    std::int32_t energy = 0;
    if (pixel.allowed >> k & 1) {
      w = launch.hypotheses[k](x, y);
      energy = UnaryEnergy(field.view.potentials, pixel.cost[k]);
      for (const auto& offset : kOffsets) {
        const int ni = i + offset[0], nj = j + offset[1];
        if (field.measured.Contains(ni, nj) && field.measured(ni, nj) > 0) {
          energy += PairwiseEnergy(field.view.potentials, w, field.measured(ni, nj));
        }
      }
    }
    field.inverse_depth[kMaxLabels * node + k] = w;
    field.unary[kMaxLabels * node + k] = energy;
  }
}

__global__ void ChosenDepthKernel(const __grid_constant__ FieldLaunch field) {
  const int i = ThreadX(), j = ThreadY();
  if (!field.chosen.Contains(i, j)) return;
  const std::int64_t node = NodeIndex(field.view, i, j);
  const std::uint8_t label = field.best_labels[node];
  if (label != kNoLabel) field.chosen(i, j) = field.inverse_depth[kMaxLabels * node + label];
}

__global__ void UpsampleKernel(const __grid_constant__ InferenceLaunch launch, HypothesisMaps maps,
                               ArrayView2D<const float> chosen) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.inferred.Contains(x, y)) return;
  launch.inferred(x, y) = 0;
  if (launch.measured_inverse_depth(x, y) > 0) return;
  const int k = UpsampleHypothesis(maps, chosen, launch.formulas, x, y);
  if (k >= 0) launch.inferred(x, y) = maps.inverse_depth[k](x, y);
}

// As JudgeInferred in infer.cc.
__global__ void MarkKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.inferred.Contains(x, y)) return;
  const float w = launch.inferred(x, y);
  PixelState state = launch.measured_inverse_depth(x, y) > 0 ? PixelState::kMeasured : PixelState::kNone;
  if (w > 0) {
    const bool is_judged = launch.formulas == Formulas::kRobust;
    state = is_judged ? Evidence(launch, x, y, w).State() : PixelState::kInferredConfirmed;
    if (state == PixelState::kNone) launch.inferred(x, y) = 0;
  }
  launch.states(x, y) = state;
}

__global__ void UnionKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.inferred.Contains(x, y)) return;
  const float measured = launch.measured_inverse_depth(x, y);
  launch.filled_and_measured(x, y) = measured > 0 ? measured : launch.inferred(x, y);
}

__global__ void CompositionKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.inferred.Contains(x, y)) return;
  const float w = launch.inferred(x, y);
  PlaneHypothesis h;
  if (launch.measured_inverse_depth(x, y) > 0) h = launch.measured(x, y);
  if (w > 0) {
    h.normal = FilledNormal(launch.reference, launch.filled_and_measured, x, y, launch.formulas);
    h.depth = 1 / w;
  }
  launch.result(x, y) = h;
}

LineOptions Lines(const InferenceLaunch& launch) {
  LineOptions options;
  options.formulas = launch.formulas;
  return options;
}

}  // namespace

void LaunchSupports(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  const int width = launch.supports.width, height = launch.supports.height;
  InverseDepthKernel<<<Grid(width, height), kBlock, 0, stream>>>(launch);
  CheckLaunch("InverseDepthKernel", task);
  SupportKernel<<<Grid(width, height), kBlock, 0, stream>>>(launch, Lines(launch));
  CheckLaunch("SupportKernel", task);
}

void LaunchScanlines(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  const int width = launch.supports.width, height = launch.supports.height;
  constexpr int kScanlineThreads = 32;  // few a block: the scanlines spread over all multiprocessors
  const dim3 blocks((width + height + kScanlineThreads - 1) / kScanlineThreads, kNumDirections);
  ScanlineKernel<<<blocks, kScanlineThreads, 0, stream>>>(launch, Lines(launch));
  CheckLaunch("ScanlineKernel", task);
}

void LaunchRegionPlanes(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  RegionPlaneKernel<<<Grid(launch.supports.width, launch.supports.height), kBlock, 0, stream>>>(launch);
  CheckLaunch("RegionPlaneKernel", task);
}

void LaunchMinCostChoice(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  MinCostKernel<<<Grid(launch.inferred.width, launch.inferred.height), kBlock, 0, stream>>>(launch);
  CheckLaunch("MinCostKernel", task);
}

void LaunchFieldSetup(const InferenceLaunch& launch, const FieldLaunch& field, cudaStream_t stream,
                      const Task& task) {
  const dim3 grid = Grid(field.view.width, field.view.height);
  Check(cudaMemsetAsync(field.totals, 0, kNumFieldTotals * sizeof(std::int64_t), stream), "cudaMemsetAsync",
        task);
  MeasuredNodeKernel<<<grid, kBlock, 0, stream>>>(launch, field.measured);
  CheckLaunch("MeasuredNodeKernel", task);
  NodeKernel<<<grid, kBlock, 0, stream>>>(launch, field);
  CheckLaunch("NodeKernel", task);
}

void LaunchFieldChoice(const InferenceLaunch& launch, const FieldLaunch& field, cudaStream_t stream,
                       const Task& task) {
  ChosenDepthKernel<<<Grid(field.view.width, field.view.height), kBlock, 0, stream>>>(field);
  CheckLaunch("ChosenDepthKernel", task);
  UpsampleKernel<<<Grid(launch.inferred.width, launch.inferred.height), kBlock, 0, stream>>>(
      launch, launch.Maps(), field.chosen);
  CheckLaunch("UpsampleKernel", task);
}

void LaunchComposition(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  const dim3 grid = Grid(launch.inferred.width, launch.inferred.height);
  MarkKernel<<<grid, kBlock, 0, stream>>>(launch);
  CheckLaunch("MarkKernel", task);
  UnionKernel<<<grid, kBlock, 0, stream>>>(launch);
  CheckLaunch("UnionKernel", task);
  CompositionKernel<<<grid, kBlock, 0, stream>>>(launch);
  CheckLaunch("CompositionKernel", task);
}

}  // namespace phi::gpu

#include "cuda/inference_kernels.h"
#include "cuda/pixel_grid.cuh"
#include "cuda/scanline_warp.cuh"
#include "cuda/transfer.h"

namespace phi::gpu {

HypothesisState InferenceLaunch::State() const {
  HypothesisState state{.evidence = evidence};
  for (int k = 0; k < kNumDirections; ++k) state.maps.inverse_depth[k] = hypotheses[k];
  state.from_region = from_region;
  return state;
}

namespace {

constexpr dim3 kBlock(32, 4);
constexpr int kScanlineThreads = 256;

dim3 Grid(int width, int height) { return PixelGrid(width, height, kBlock); }

// The view policy of infer_pixel.h. The samples are read again for each hypothesis and view.
struct GpuInferenceContext {
  struct Patch {};

  const InferenceLaunch& launch;
  const InferenceParameters& parameters;
  const HypothesisState& state;
  const TextureSampler& reference;

  __device__ __forceinline__ GpuInferenceContext(const InferenceLaunch& l, const HypothesisState& s)
      : launch(l), parameters(l.parameters), state(s), reference(l.reference_texture) {}

  __device__ __forceinline__ const RelativeView& View(int j) const { return launch.sources[j].view; }
  __device__ __forceinline__ const MeasuredDepthsView& Depths(int j) const {
    return launch.sources[j].measured;
  }
  __device__ __forceinline__ Patch LoadPatch(int, int) const { return {}; }
  __device__ __forceinline__ void Costs(const Patch&, int x, int y, int k, float* costs) const {
    for (int j = 0; j < parameters.num_views; ++j) {
      const SampledView<TextureSampler> source = {launch.sources[j].texture, View(j)};
      costs[j] = HypothesisViewCost(reference, source, parameters.window, state.maps.inverse_depth[k], x, y);
    }
  }
};

__global__ void InverseDepthKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.measured.Contains(x, y)) return;
  const PixelState state = launch.states(x, y);
  const float depth = launch.measured(x, y).depth;
  launch.evidence(x, y) = EvidenceAt(state, depth);
  launch.carrying(x, y) = AnchorAt(state, depth, launch.parameters.method.formulas);
}

__global__ void LineAnchorKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.carrying.Contains(x, y)) return;
  const std::uint8_t limits = launch.line_limits.data != nullptr ? launch.line_limits(x, y) : 0;
  const float anchor = LineAnchor(launch.carrying(x, y), launch.evidence(x, y), limits);
  launch.carrying(x, y) = anchor;
  for (int k = 0; k < kNumDirections; ++k) launch.hypotheses[k](x, y) = anchor;
}

// One warp a scanline; blockIdx.y is the direction. Scanlines side by side are a block's: they read the same lines of the cache.
__global__ void __launch_bounds__(kScanlineThreads)
    ScanlineKernel(const __grid_constant__ InferenceLaunch launch, const __grid_constant__ LineOptions options) {
  const int direction = blockIdx.y, width = launch.carrying.width, height = launch.carrying.height;
  const int index = ThreadX() / kWarp;
  if (index >= NumScanlines(direction, width, height)) return;
  WarpScanline(MakeScanline(direction, index, width, height), launch.carrying, launch.line_limits, options,
               launch.hypotheses[direction])
      .Fill();
}

__global__ void RegionPlaneKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.carrying.Contains(x, y)) return;
  std::uint8_t from_region = 0;
  if (!(launch.evidence(x, y) > 0)) {
    float planes[kPlanesPerRegion];
    for (int i = 0; i < kPlanesPerRegion; ++i) planes[i] = launch.region_planes[i](x, y);
    const bool asks_brightness = launch.parameters.method.rules.IsOn(Rule::kOverexposed);
    const float brightness = asks_brightness ? launch.reference_texture(x + 0.5f, y + 0.5f) : 0.0f;
    from_region = PutRegionPlanes(planes, brightness, x, y, launch.hypotheses);
  }
  launch.from_region(x, y) = from_region;
}

__global__ void MinCostKernel(const __grid_constant__ InferenceLaunch launch,
                              const __grid_constant__ HypothesisState state) {
  const int x = ThreadX(), y = ThreadY();
  if (launch.inferred.Contains(x, y))
    launch.inferred(x, y) = CheapestInverseDepth(GpuInferenceContext(launch, state), x, y);
}

__global__ void NodeEvidenceKernel(const __grid_constant__ InferenceLaunch launch,
                                   ArrayView2D<float> evidence) {
  const int i = ThreadX(), j = ThreadY();
  if (evidence.Contains(i, j)) evidence(i, j) = launch.evidence(kFieldStride * i, kFieldStride * j);
}

__device__ void CountOne(const FieldLaunch& field, FieldTotal total) {
  atomicAdd(reinterpret_cast<unsigned long long*>(field.totals + total), 1ull);
}

// Reads the neighbours' evidence, which NodeEvidenceKernel has written.
__global__ void NodeKernel(const __grid_constant__ InferenceLaunch launch,
                           const __grid_constant__ HypothesisState state,
                           const __grid_constant__ FieldLaunch field) {
  const int i = ThreadX(), j = ThreadY();
  if (!field.evidence.Contains(i, j)) return;
  const std::int64_t index = NodeIndex(field.view, i, j);
  const FieldNode node =
      MakeFieldNode(GpuInferenceContext(launch, state), field.view.potentials, field.evidence, i, j);
  field.allowed[index] = node.hypotheses.offered;
  field.chosen(i, j) = node.unlabelled;
  if (!(field.evidence(i, j) > 0) && node.hypotheses.offered == 0) CountOne(field, kWithoutHypothesis);
  for (int k = 0; k < kNumDirections; ++k) {
    field.inverse_depth[kMaxLabels * index + k] = node.inverse_depth[k];
    field.unary[kMaxLabels * index + k] = node.unary[k];
  }
}

__global__ void ChosenDepthKernel(const __grid_constant__ FieldLaunch field) {
  const int i = ThreadX(), j = ThreadY();
  if (!field.chosen.Contains(i, j)) return;
  const std::int64_t node = NodeIndex(field.view, i, j);
  const std::uint8_t label = field.best_labels[node];
  if (label != kNoLabel) field.chosen(i, j) = field.inverse_depth[kMaxLabels * node + label];
}

__global__ void UpsampleKernel(const __grid_constant__ InferenceLaunch launch,
                               const __grid_constant__ HypothesisState state,
                               ArrayView2D<const float> chosen) {
  const int x = ThreadX(), y = ThreadY();
  if (launch.inferred.Contains(x, y))
    launch.inferred(x, y) = UpsampledInverseDepth(state, chosen, launch.parameters.method.formulas, x, y);
}

__global__ void MarkKernel(const __grid_constant__ InferenceLaunch launch,
                           const __grid_constant__ HypothesisState state) {
  const int x = ThreadX(), y = ThreadY();
  if (launch.inferred.Contains(x, y))
    launch.states(x, y) = StateAfterInference(GpuInferenceContext(launch, state), x, y, launch.inferred(x, y));
}

__global__ void UnionKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.inferred.Contains(x, y)) return;
  const float evidence = launch.evidence(x, y);
  launch.filled_and_measured(x, y) = evidence > 0 ? evidence : launch.inferred(x, y);
}

__global__ void CompositionKernel(const __grid_constant__ InferenceLaunch launch) {
  const int x = ThreadX(), y = ThreadY();
  if (!launch.inferred.Contains(x, y)) return;
  const PlaneHypothesis evidence = launch.evidence(x, y) > 0 ? launch.measured(x, y) : PlaneHypothesis();
  launch.result(x, y) =
      ComposedPlane(launch.parameters, evidence, launch.inferred(x, y), launch.filled_and_measured, x, y);
}

}  // namespace

void LaunchInverseDepths(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  InverseDepthKernel<<<Grid(launch.carrying.width, launch.carrying.height), kBlock, 0, stream>>>(launch);
  CheckLaunch("InverseDepthKernel", task);
}

void LaunchScanlines(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  const int width = launch.carrying.width, height = launch.carrying.height;
  LineAnchorKernel<<<Grid(width, height), kBlock, 0, stream>>>(launch);
  CheckLaunch("LineAnchorKernel", task);
  const dim3 blocks((kWarp * (width + height) + kScanlineThreads - 1) / kScanlineThreads, kNumDirections);
  ScanlineKernel<<<blocks, kScanlineThreads, 0, stream>>>(launch, MakeLineOptions(launch.parameters.method));
  CheckLaunch("ScanlineKernel", task);
}

void LaunchRegionPlanes(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  RegionPlaneKernel<<<Grid(launch.carrying.width, launch.carrying.height), kBlock, 0, stream>>>(launch);
  CheckLaunch("RegionPlaneKernel", task);
}

void LaunchMinCostChoice(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  MinCostKernel<<<Grid(launch.inferred.width, launch.inferred.height), kBlock, 0, stream>>>(launch,
                                                                                            launch.State());
  CheckLaunch("MinCostKernel", task);
}

void LaunchFieldSetup(const InferenceLaunch& launch, const FieldLaunch& field, cudaStream_t stream,
                      const Task& task) {
  const dim3 grid = Grid(field.view.width, field.view.height);
  ClearOnDevice(field.totals, kNumFieldTotals, stream, task);
  NodeEvidenceKernel<<<grid, kBlock, 0, stream>>>(launch, field.evidence);
  CheckLaunch("NodeEvidenceKernel", task);
  NodeKernel<<<grid, kBlock, 0, stream>>>(launch, launch.State(), field);
  CheckLaunch("NodeKernel", task);
}

void LaunchFieldChoice(const InferenceLaunch& launch, const FieldLaunch& field, cudaStream_t stream,
                       const Task& task) {
  ChosenDepthKernel<<<Grid(field.view.width, field.view.height), kBlock, 0, stream>>>(field);
  CheckLaunch("ChosenDepthKernel", task);
  UpsampleKernel<<<Grid(launch.inferred.width, launch.inferred.height), kBlock, 0, stream>>>(
      launch, launch.State(), field.chosen);
  CheckLaunch("UpsampleKernel", task);
}

void LaunchComposition(const InferenceLaunch& launch, cudaStream_t stream, const Task& task) {
  const dim3 grid = Grid(launch.inferred.width, launch.inferred.height);
  MarkKernel<<<grid, kBlock, 0, stream>>>(launch, launch.State());
  CheckLaunch("MarkKernel", task);
  UnionKernel<<<grid, kBlock, 0, stream>>>(launch);
  CheckLaunch("UnionKernel", task);
  CompositionKernel<<<grid, kBlock, 0, stream>>>(launch);
  CheckLaunch("CompositionKernel", task);
}

}  // namespace phi::gpu

// Plane hypothesis inference of one image: uploads, launches, one synchronisation, download.
#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "cuda/calls_on_gpu.h"
#include "cuda/inference_kernels.h"
#include "cuda/memory_plan.h"
#include "phi/base/cancellation.h"
#include "phi/base/whole_array.h"
#include "phi/inference/infer_setup.h"
#include "phi/inference/potential_tables.h"
#include "phi/inference/region_pixels.h"
#include "phi/inference/region_planes.h"

namespace phi::gpu {
namespace {

using TextureHandle = std::shared_ptr<const GrayPyramid>;
using DepthsHandle = std::shared_ptr<const DeviceMeasuredDepths>;

// What a launch reads from the caches; keeps it alive.
struct SourceHandles {
  std::vector<TextureHandle> textures;
  std::vector<DepthsHandle> depths;
};

SourceHandles BindSources(DeviceResources* device, const InferenceInput& input, Scratch* scratch,
                          const Task& task, InferenceLaunch* launch) {
  const cudaStream_t stream = scratch->stream.get();
  SourceHandles handles;
  handles.textures.push_back(device->images.Get(input.reference.image, stream));
  launch->reference_texture = {handles.textures.front()->level(0).get()};
  std::vector<InferenceSource> sources;
  for (std::size_t j = 0; j < static_cast<std::size_t>(launch->parameters.num_views); ++j) {
    const ViewImage& source = input.sources[j];
    handles.textures.push_back(device->images.Get(source.image, stream));
    sources.push_back({MakeRelativeView(input.reference.view->camera, source.view->camera),
                       {handles.textures.back()->level(0).get()}});
    if (launch->parameters.method.formulas == Formulas::kPaper) continue;
    const auto depths = input.DepthsOf(j);
    if (depths == nullptr) continue;
    handles.depths.push_back(device->measured.Get(depths, stream));
    sources.back().measured = handles.depths.back()->View();
  }
  InferenceScratch& buffers = scratch->inference;
  buffers.sources.Reserve(kMaxSourceViews, task);
  buffers.sources.Upload(sources.data(), static_cast<std::int64_t>(sources.size()), stream, task);
  launch->sources = buffers.sources.data();
  return handles;
}

void BindMaps(Scratch* scratch, int width, int height, const Task& task, InferenceLaunch* launch) {
  const std::int64_t n = static_cast<std::int64_t>(width) * height;
  InferenceScratch& buffers = scratch->inference;
  buffers.inverse_depths.Reserve(InferenceScratch::kPixelFloats * n, task);
  scratch->plane.Reserve(n, task);
  scratch->states.Reserve(n, task);
  float* next = buffers.inverse_depths.data();
  const auto take = [&] { return ArrayView2D<float>{std::exchange(next, next + n), width, height}; };
  launch->evidence = take();
  launch->inferred = take();
  launch->filled_and_measured = take();
  for (auto& hypotheses : launch->hypotheses) hypotheses = take();
  // Needed before anything is inferred, and no longer then: they share the memory.
  launch->region_planes[0] = launch->inferred;
  launch->carrying = launch->filled_and_measured;
  launch->region_planes[1] = launch->filled_and_measured;
  launch->result = scratch->plane.View(width, height);  // the measured map until the composition
  launch->measured = launch->result;
  launch->states = scratch->states.View(width, height);
  // Needed after the measured states were read, until the field is set up; the new states come last.
  static_assert(sizeof(PixelState) == sizeof(std::uint8_t));
  if (launch->parameters.method.formulas != Formulas::kRobust) return;
  launch->from_region = {reinterpret_cast<std::uint8_t*>(launch->states.data), width, height};
  launch->line_limits = launch->from_region;
}

void UploadMeasured(const MeasurementMap& measured, StagingPool* staging, Scratch* scratch, const Task& task) {
  const std::int64_t n = static_cast<std::int64_t>(measured.size());
  staging->Upload(measured.planes.data(), n, scratch->plane.data(), task);
  staging->Upload(measured.states.data(), n, scratch->states.data(), task);
}

// Page-locked memory for what goes to and fro while regions are found: the result's, which comes last.
struct RegionBuffers {
  float *anchors, *planes;
  std::uint8_t* line_limits;

  // host_plane and host_states must have room for the result.
  RegionBuffers(Scratch* scratch, std::int64_t num_pixels)
      : anchors(reinterpret_cast<float*>(scratch->host_plane.data())),
        planes(anchors + num_pixels),
        line_limits(reinterpret_cast<std::uint8_t*>(scratch->host_states.data())) {
    static_assert(sizeof(PlaneHypothesis) >= (1 + kPlanesPerRegion) * sizeof(float));
  }
};

void UploadLineLimits(const RegionPlanes& planes, Scratch* scratch, const InferenceLaunch& launch, const Task& task) {
  const RegionBuffers buffers(scratch, launch.carrying.size());
  const ArrayView2D<const float> anchors = {buffers.anchors, launch.carrying.width, launch.carrying.height};
  const Mask limits = planes.LineLimits(anchors, launch.parameters.method.rules);
  std::uint8_t* host = buffers.line_limits;
  CopyAll(limits.data(), limits.size(), host);
  CopyToDevice(launch.line_limits.data, host, launch.line_limits.size(), scratch->stream.get(), task);
}

// Planes are found on the host; then the scanlines run, while the host works out the planes' depths.
RegionPlanes AddRegionPlanes(const InferenceInput& input, std::shared_ptr<const ImageRegions> regions, Scratch* scratch,
                             const InferenceLaunch& launch, const Task& task) {
  const int width = launch.carrying.width, height = launch.carrying.height;
  const std::int64_t n = launch.carrying.size();
  InferenceScratch& buffers = scratch->inference;
  const RegionBuffers host_buffers(scratch, n);
  RegionPlanes planes =
      FindRegionPlanes(input, std::move(regions), {host_buffers.anchors, width, height}, launch.parameters.method.rules);
  const cudaStream_t stream = scratch->stream.get();
  UploadLineLimits(planes, scratch, launch, task);
  LaunchScanlines(launch, stream, task);
  float* host = host_buffers.planes;
  tbb::parallel_for(0, height, [&](int y) {
    for (int k = 0; k < kPlanesPerRegion; ++k) {
      float* row = host + k * n + static_cast<std::int64_t>(y) * width;
      std::fill(row, row + width, 0.0f);
      planes.ForFittedRuns(y, [&](int begin, int end, const FittedRegion& region) {
        if (!region.planes[k].IsThere()) return;
        for (int x = begin; x < end; ++x) row[x] = region.planes[k].At(x, y);
      });
    }
  });
  const std::int64_t first = launch.region_planes[0].data - buffers.inverse_depths.data();
  buffers.inverse_depths.UploadAt(first, host, kPlanesPerRegion * n, stream, task);
  LaunchRegionPlanes(launch, stream, task);
  return planes;
}

// Returns the regions' planes; nullopt: none were looked for.
std::optional<RegionPlanes> MakeHypotheses(const InferenceInput& input, Scratch* scratch,
                                           const InferenceLaunch& launch, const Task& task) {
  const cudaStream_t stream = scratch->stream.get();
  LaunchInverseDepths(launch, stream, task);
  if (launch.parameters.method.formulas == Formulas::kPaper) {
    LaunchScanlines(launch, stream, task);
    return std::nullopt;
  }
  const Event anchors_ready(Event::Timing::kOff, task);
  const std::int64_t num_pixels = launch.carrying.size();
  scratch->host_plane.Reserve(num_pixels, task);
  scratch->host_states.Reserve(num_pixels, task);
  CopyToHost(RegionBuffers(scratch, num_pixels).anchors, launch.carrying.data, num_pixels, stream, task);
  anchors_ready.Record(stream, task);
  const std::shared_ptr<const ImageRegions> regions = RegionsOf(input, launch.parameters.method.rules);
  anchors_ready.Wait(task);
  return AddRegionPlanes(input, regions, scratch, launch, task);
}

FieldLaunch BindField(Scratch* scratch, int width, int height, const PotentialTables& tables,
                      const Task& task) {
  InferenceScratch& buffers = scratch->inference;
  FieldLaunch field;
  field.view.width = NumNodesAlong(width);
  field.view.height = NumNodesAlong(height);
  const std::int64_t n = static_cast<std::int64_t>(field.view.width) * field.view.height;
  buffers.node_bytes.Reserve(InferenceScratch::kByteFields * n, task);
  buffers.node_floats.Reserve(InferenceScratch::kFloatFields * n, task);
  buffers.node_integers.Reserve(InferenceScratch::kIntegerFields * n, task);
  buffers.totals.Reserve(kNumFieldTotals, task);
  buffers.tables.Reserve(kUnaryTableSize + kPairwiseTableSize, task);
  const cudaStream_t stream = scratch->stream.get();
  buffers.tables.Upload(tables.unary().data(), kUnaryTableSize, stream, task);
  buffers.tables.UploadAt(kUnaryTableSize, tables.pairwise().data(), kPairwiseTableSize, stream, task);

  field.allowed = buffers.node_bytes.data();
  field.best_labels = field.allowed + n;
  field.inverse_depth = buffers.node_floats.data();
  field.evidence = {field.inverse_depth + kMaxLabels * n, field.view.width, field.view.height};
  field.chosen = {field.evidence.data + n, field.view.width, field.view.height};
  field.unary = buffers.node_integers.data();
  field.totals = buffers.totals.data();
  field.view.potentials = {buffers.tables.data(), buffers.tables.data() + kUnaryTableSize};
  field.view.allowed = field.allowed;
  field.view.inverse_depth = field.inverse_depth;
  field.view.unary = field.unary;
  field.view.horizontal = field.unary + kMaxLabels * n;
  field.view.vertical = field.view.horizontal + kMaxLabels * n;
  field.view.label = field.best_labels + n;
  return field;
}

FieldStatistics Statistics(const std::int64_t* totals) {
  return {.num_nodes = totals[kNumNodes],
          .energy = totals[kBestEnergy] * kNatsPerEnergyUnit,
          .lower_bound = totals[kLowerBound] * kNatsPerEnergyUnit,
          .min_cost_energy = totals[kMinCostEnergy] * kNatsPerEnergyUnit,
          .num_unlike_min_cost = totals[kUnlikeMinCost],
          .num_without_hypothesis = totals[kWithoutHypothesis]};
}

}  // namespace

InferenceResult InferOnGpu(DeviceResources* device, const InferenceInput& input, const StereoOptions& stereo,
                           const InferenceOptions& options) {
  CheckInferenceInput(input);
  const int width = input.measured->width(), height = input.measured->height();
  const Task task{"plane inference", input.reference.view->name, width, height};
  if (options.mode == InferenceMode::kOff) return {*input.measured, {}};

  const std::int64_t bytes = PlanInference(input, device->budget.bytes(), task);
  const MemoryBudget::Lease lease(&device->budget, bytes);
  ScratchPool<Scratch>::Lease scratch(&device->scratch, task);
  const cudaStream_t stream = scratch->stream.get();
  const std::size_t num_calls = device->NumCallsAtOnce(bytes), num_matched = input.NumMatched();
  const CacheSizes sizes = {.images = num_calls * (num_matched + 1), .measured = num_calls * num_matched};
  device->MakeRoom(CallKind::kInference, bytes, sizes, scratch.get());
  InferenceLaunch launch;
  launch.parameters = MakeInferenceParameters(input, stereo, options.method);
  const SourceHandles handles = BindSources(device, input, scratch.get(), task, &launch);
  BindMaps(scratch.get(), width, height, task, &launch);
  UploadMeasured(*input.measured, &device->staging, scratch.get(), task);
  const bool solves_field = options.mode == InferenceMode::kMrf;
  const PotentialTables tables(options);

  ThrowIfCancelled();
  scratch->begin.Record(stream, task);
  const std::optional<RegionPlanes> region_planes = MakeHypotheses(input, scratch.get(), launch, task);
  if (solves_field) {
    const FieldLaunch field = BindField(scratch.get(), width, height, tables, task);
    LaunchFieldSetup(launch, field, stream, task);
    LaunchFieldSolution(field, options.num_passes, stream, task);
    LaunchFieldChoice(launch, field, stream, task);
    scratch->inference.host_totals.Download(scratch->inference.totals, kNumFieldTotals, stream, task);
  } else {
    LaunchMinCostChoice(launch, stream, task);
  }
  LaunchComposition(launch, stream, task);
  scratch->end.Record(stream, task);
  device->NoteMemory(task);
  const std::int64_t num_pixels = launch.result.size();
  scratch->host_plane.Download(scratch->plane, num_pixels, stream, task);
  scratch->host_states.Download(scratch->states, num_pixels, stream, task);
  scratch->stream.Synchronize(task);

  device->times.Add(CallKind::kInference, scratch->begin, scratch->end, 0, task);
  InferenceResult result{{PlaneMap::Uninitialized(width, height), StateMap::Uninitialized(width, height)},
                         {}};
  CopyAll(scratch->host_plane.data(), result.map.size(), result.map.planes.data());
  CopyAll(scratch->host_states.data(), result.map.size(), result.map.states.data());
  if (region_planes)
    FinishRegionPixels(*region_planes, input, options.method.rules, &result.map);
  if (solves_field) result.statistics = Statistics(scratch->inference.host_totals.data());
  return result;
}

}  // namespace phi::gpu

// The estimation of one reference image: uploads, launches, one synchronisation, download.
#include <cstring>
#include <memory>
#include <vector>

#include "cuda/device_resources.h"
#include "cuda/estimation_in_bands.h"
#include "cuda/memory_plan.h"
#include "phi/base/cancellation.h"
#include "phi/initialization.h"
#include "phi/matching/estimation_setup.h"

namespace phi::gpu {
namespace {

using TextureHandle = std::shared_ptr<const GrayPyramid>;

// Fills in the textures; the handles keep them alive until the call ends.
std::vector<TextureHandle> BindTextures(DeviceResources* device, const EstimationInput& input,
                                        cudaStream_t stream, const Task& task, EstimationLaunch* launch) {
  auto& images = launch->form == ImageForm::kQuads ? device->images : device->compact_images;
  std::vector<TextureHandle> handles;
  handles.push_back(images.Get(input.reference.image, stream, task));
  handles.back()->CopyTextures(launch->reference);
  const std::vector<RelativeView> views = MakeRelativeViews(input);
  for (std::size_t j = 0; j < views.size(); ++j) {
    handles.push_back(images.Get(input.sources[j].image, stream, task));
    launch->sources[j] = {views[j].a, views[j].b, views[j].source.width, views[j].source.height, {}, {}};
    handles.back()->CopyTextures(launch->sources[j].textures);
    handles.back()->CopyQuads(launch->sources[j].quads);
  }
  return handles;
}

// Gives up what an estimation does not use; see DeviceResources.
void PrepareMemory(DeviceResources* device, Scratch* scratch, const EstimationPlan& plan,
                   std::size_t num_sources) {
  const std::size_t num_calls = device->NumCallsAtOnce(plan.bytes);
  CacheSizes sizes;
  (plan.form == ImageForm::kQuads ? sizes.images : sizes.compact_images) = num_calls * (num_sources + 1);
  sizes.depths = num_calls * num_sources;
  device->KeepOnly(sizes);
  scratch->inference.FreeDeviceMaps();
}

// The state of the whole image, and its rows.
void BindState(Scratch* scratch, const Task& task, EstimationLaunch* launch) {
  const std::int64_t num_pixels = static_cast<std::int64_t>(task.width) * task.height;
  scratch->plane.Reserve(num_pixels, task);
  scratch->cost.Reserve(num_pixels, task);
  scratch->estimation.selected_views.Reserve(num_pixels, task);
  scratch->estimation.view_costs.Reserve(num_pixels * launch->parameters.num_views, task);
  launch->state = {scratch->plane.View(task.width, task.height), scratch->cost.View(task.width, task.height),
                   scratch->estimation.selected_views.View(task.width, task.height),
                   scratch->estimation.view_costs.data(), num_pixels};
}

void BindWindowsAndCounter(Scratch* scratch, const Task& task, EstimationLaunch* launch) {
  EstimationScratch& buffers = scratch->estimation;
  buffers.window_levels.Reserve(static_cast<std::int64_t>(task.width) * task.height, task);
  launch->window_levels = buffers.window_levels.View(task.width, task.height);
  buffers.num_windows.Reserve(1, task);
  Check(cudaMemsetAsync(buffers.num_windows.data(), 0, buffers.num_windows.bytes(), scratch->stream.get()),
        "cudaMemsetAsync", task);
  launch->num_windows = buffers.num_windows.data();
}

InitialDepths UploadInitialDepths(Scratch* scratch, const DepthRangeMap& ranges, const Task& task) {
  static_assert(sizeof(DepthRange) == sizeof(float2));
  const std::int64_t num_cells = static_cast<std::int64_t>(ranges.size());
  scratch->estimation.ranges.Reserve(num_cells, task);
  scratch->estimation.ranges.Upload(reinterpret_cast<const float2*>(ranges.data()), num_cells,
                                    scratch->stream.get(), task);
  InitialDepths initial;
  initial.ranges = scratch->estimation.ranges.View(ranges.width(), ranges.height());
  initial.cell = kDepthRangeCell;
  return initial;
}

using DepthsHandle = std::shared_ptr<const DeviceDepths>;

// The source views' depths for guidance; the handles keep them alive until the call ends.
std::vector<DepthsHandle> BindGuidance(DeviceResources* device, const EstimationInput& input,
                                       Scratch* scratch, const Task& task, EstimationLaunch* launch) {
  const cudaStream_t stream = scratch->stream.get();
  std::vector<DepthsHandle> handles;
  if (input.source_maps.empty()) return handles;
  const std::vector<RelativeView> views = MakeRelativeViews(input);
  std::vector<GuidanceSource> guidance;
  for (std::size_t j = 0; j < views.size(); ++j) {
    guidance.push_back({views[j], {}});
    if (input.source_maps[j] == nullptr) continue;
    handles.push_back(device->depths.Get(input.source_maps[j], stream, task));
    guidance.back().depths = handles.back()->View();
  }
  scratch->estimation.guidance.Reserve(kMaxSourceViews, task);
  scratch->estimation.guidance.Upload(guidance.data(), static_cast<std::int64_t>(guidance.size()), stream,
                                      task);
  launch->guidance = scratch->estimation.guidance.data();
  return handles;
}

void EstimateWhole(EstimationLaunch launch, InitialDepths initial, const PlaneMap* earlier, Scratch* scratch,
                   const Task& task) {
  const cudaStream_t stream = scratch->stream.get();
  const std::int64_t num_pixels = launch.state.plane.size();
  if (earlier != nullptr) {
    scratch->plane.Upload(earlier->data(), num_pixels, stream, task);
    initial.hypotheses = launch.state.plane;
  }
  LaunchInitialization(launch, initial, stream, task);
  const EstimationParameters& p = launch.parameters;
  for (int iteration = p.first_iteration; iteration < p.end_iteration; ++iteration) {
    for (const int colour : {0, 1}) LaunchHalfPass(launch, iteration, colour, stream, task);
  }
}

void EstimateByBands(const EstimationLaunch& launch, int band_rows, const InitialDepths& initial,
                     const PlaneMap* earlier, Scratch* scratch, const Task& task) {
  EstimationInBands estimation(launch, band_rows, scratch, task);
  estimation.Initialize(initial, earlier);
  const EstimationParameters& p = launch.parameters;
  for (int iteration = p.first_iteration; iteration < p.end_iteration; ++iteration) {
    for (const int colour : {0, 1}) estimation.HalfPass(iteration, colour);
  }
}

// Waits for the device.
EstimationResult TakeResult(const Scratch& scratch, const Task& task) {
  EstimationResult result{PlaneMap(task.width, task.height), CostMap(task.width, task.height)};
  scratch.stream.Synchronize(task);
  std::memcpy(result.map.data(), scratch.host_plane.data(), result.map.bytes());
  std::memcpy(result.cost.data(), scratch.host_cost.data(), result.cost.bytes());
  return result;
}

}  // namespace

EstimationResult EstimateOnGpu(DeviceResources* device, const EstimationInput& input,
                               const StereoOptions& options) {
  const Pinhole& size = input.reference.view->camera.pinhole;
  const Task task{"estimation", input.reference.view->name, size.width, size.height};
  EstimationLaunch launch;
  launch.parameters = MakeEstimationParameters(input, options);
  const DepthRangeMap ranges = NearestPointDepthRanges(input.sparse, size.width, size.height);
  const EstimationPlan plan = PlanEstimation(input, device->budget.bytes(), task);
  const bool is_whole = plan.band_rows == 0;
  launch.form = plan.form;
  launch.end_row = size.height;

  const MemoryBudget::Lease lease(&device->budget, plan.bytes);
  ScratchPool::Lease scratch(&device->scratch, task);
  const cudaStream_t stream = scratch->stream.get();
  PrepareMemory(device, scratch.get(), plan, input.sources.size());
  if (is_whole) BindState(scratch.get(), task, &launch);
  BindWindowsAndCounter(scratch.get(), task, &launch);
  const std::vector<TextureHandle> textures = BindTextures(device, input, stream, task, &launch);
  const InitialDepths initial = UploadInitialDepths(scratch.get(), ranges, task);
  const std::vector<DepthsHandle> depths = BindGuidance(device, input, scratch.get(), task, &launch);

  ThrowIfCancelled();
  scratch->begin.Record(stream, task);
  LaunchWindowLevels(launch, stream, task);
  if (is_whole) {
    EstimateWhole(launch, initial, input.initial.get(), scratch.get(), task);
  } else {
    EstimateByBands(launch, plan.band_rows, initial, input.initial.get(), scratch.get(), task);
  }
  scratch->end.Record(stream, task);
  if (is_whole) {
    scratch->host_plane.Download(scratch->plane, launch.state.plane.size(), stream, task);
    scratch->host_cost.Download(scratch->cost, launch.state.cost.size(), stream, task);
  }
  scratch->estimation.host_num_windows.Download(scratch->estimation.num_windows, 1, stream, task);
  device->NoteMemory(task);
  EstimationResult result = TakeResult(*scratch.get(), task);
  const double num_samples = static_cast<double>(*scratch->estimation.host_num_windows.data()) *
                             launch.parameters.window.NumSamples();
  device->times.Add(DeviceTimes::kEstimation, scratch->begin, scratch->end, num_samples, task);
  return result;
}

}  // namespace phi::gpu

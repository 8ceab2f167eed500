// The estimation of one reference image: uploads, launches, one synchronisation, download.
#include <cstring>
#include <memory>
#include <vector>

#include "cuda/device_resources.h"
#include "cuda/estimation_kernels.h"
#include "phi/base/cancellation.h"
#include "phi/initialization.h"
#include "phi/matching/estimation_setup.h"

namespace phi::gpu {
namespace {

using TextureHandle = std::shared_ptr<const GrayPyramid>;

// Fills in the textures; the handles keep them alive until the call ends.
std::vector<TextureHandle> BindTextures(DeviceResources* device, const EstimationInput& input,
                                        cudaStream_t stream, const Task& task, EstimationLaunch* launch) {
  std::vector<TextureHandle> handles;
  handles.push_back(device->images.Get(input.reference.image, stream, task));
  handles.back()->CopyTextures(launch->reference);
  const std::vector<RelativeView> views = MakeRelativeViews(input);
  for (std::size_t j = 0; j < views.size(); ++j) {
    handles.push_back(device->images.Get(input.sources[j].image, stream, task));
    launch->sources[j] = {views[j].a, views[j].b, views[j].source.width, views[j].source.height, {}, {}};
    handles.back()->CopyTextures(launch->sources[j].textures);
    handles.back()->CopyQuads(launch->sources[j].quads);
  }
  return handles;
}

// Gives up what an estimation does not use; see DeviceResources.
void PrepareMemory(DeviceResources* device, Scratch* scratch, std::size_t num_sources) {
  device->images.KeepAtMost(2 * (num_sources + 1));
  device->depths.KeepAtMost(2 * num_sources);
  device->maps.KeepAtMost(0);
  scratch->inference.FreeDeviceMaps();
}

void ReserveState(Scratch* scratch, std::int64_t num_pixels, int num_views, const Task& task) {
  scratch->plane.Reserve(num_pixels, task);
  scratch->cost.Reserve(num_pixels, task);
  scratch->estimation.selected_views.Reserve(num_pixels, task);
  scratch->estimation.view_costs.Reserve(num_pixels * num_views, task);
  scratch->estimation.window_levels.Reserve(num_pixels, task);
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

// An earlier estimate to start from, in the state itself, and the source views' depths; the handles keep these alive
// until the call ends.
std::vector<DepthsHandle> BindEarlierMaps(DeviceResources* device, const EstimationInput& input,
                                          Scratch* scratch, const Task& task, InitialDepths* initial,
                                          EstimationLaunch* launch) {
  const cudaStream_t stream = scratch->stream.get();
  std::vector<DepthsHandle> handles;
  if (input.initial != nullptr) {
    const PlaneMap& map = *input.initial;
    scratch->plane.Upload(map.data(), static_cast<std::int64_t>(map.size()), stream, task);
    initial->hypotheses = scratch->plane.View(map.width(), map.height());
  }
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

// Samples of source windows that a full estimation takes: each pixel's first hypothesis, then eight propagated and
// three refined ones per iteration.
double NumSamples(const EstimationParameters& p) {
  const double pixels = static_cast<double>(p.reference.width) * p.reference.height;
  return pixels * p.num_views * p.window.NumSamples() * (1.0 + 11.0 * (p.end_iteration - p.first_iteration));
}

}  // namespace

EstimationResult EstimateOnGpu(DeviceResources* device, const EstimationInput& input,
                               const StereoOptions& options) {
  const Pinhole& size = input.reference.view->camera.pinhole;
  const Task task{"estimation", input.reference.view->name, size.width, size.height};
  EstimationLaunch launch;
  launch.parameters = MakeEstimationParameters(input, options);
  const DepthRangeMap ranges = NearestPointDepthRanges(input.sparse, size.width, size.height);

  ScratchPool::Lease scratch(&device->scratch, task);
  const cudaStream_t stream = scratch->stream.get();
  const std::int64_t num_pixels = static_cast<std::int64_t>(size.width) * size.height;
  PrepareMemory(device, scratch.get(), input.sources.size());
  ReserveState(scratch.get(), num_pixels, launch.parameters.num_views, task);
  launch.state = {scratch->plane.View(size.width, size.height), scratch->cost.View(size.width, size.height),
                  scratch->estimation.selected_views.View(size.width, size.height),
                  scratch->estimation.view_costs.data()};
  launch.window_levels = scratch->estimation.window_levels.View(size.width, size.height);
  const std::vector<TextureHandle> textures = BindTextures(device, input, stream, task, &launch);
  InitialDepths initial = UploadInitialDepths(scratch.get(), ranges, task);
  const std::vector<DepthsHandle> depths =
      BindEarlierMaps(device, input, scratch.get(), task, &initial, &launch);

  ThrowIfCancelled();
  scratch->begin.Record(stream, task);
  LaunchWindowLevels(launch, stream, task);
  LaunchInitialization(launch, initial, stream, task);
  for (int i = launch.parameters.first_iteration; i < launch.parameters.end_iteration; ++i)
    LaunchIteration(launch, i, stream, task);
  scratch->end.Record(stream, task);
  scratch->host_plane.Download(scratch->plane, num_pixels, stream, task);
  scratch->host_cost.Download(scratch->cost, num_pixels, stream, task);
  device->NoteMemory(task);
  EstimationResult result{PlaneMap(size.width, size.height), CostMap(size.width, size.height)};
  scratch->stream.Synchronize(task);

  device->times.Add(DeviceTimes::kEstimation, scratch->begin, scratch->end, NumSamples(launch.parameters),
                    task);
  std::memcpy(result.map.data(), scratch->host_plane.data(), result.map.bytes());
  std::memcpy(result.cost.data(), scratch->host_cost.data(), result.cost.bytes());
  return result;
}

}  // namespace phi::gpu

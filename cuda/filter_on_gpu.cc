// The consistency filter of one reference map: maps come from the cache, a mask of kept pixels goes back.
#include <memory>
#include <vector>

#include "cuda/device_resources.h"
#include "cuda/filtering_kernels.h"
#include "phi/filtering/filter_setup.h"

namespace phi::gpu {
namespace {

using MapHandle = std::shared_ptr<const DeviceMap>;

// Kept pixels of the reference map; the rest have no depth.
PlaneMap KeptPixels(const PlaneMap& map, const std::uint8_t* keep) {
  PlaneMap kept(map.width(), map.height());
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (keep[i]) kept.data()[i] = map.data()[i];
  }
  return kept;
}

void UploadSources(DeviceResources* device, const FilterInput& input, const FilterContext& context,
                   Scratch* scratch, const Task& task, std::vector<FilterSource>* sources,
                   std::vector<MapHandle>* handles) {
  const cudaStream_t stream = scratch->stream.get();
  for (const ViewMap& source : input.sources) {
    if (source.map == nullptr) continue;
    handles->push_back(device->maps.Get(source.map, stream, task));
    sources->push_back({context.views[sources->size()], handles->back()->View()});
  }
  const std::int64_t num_sources = static_cast<std::int64_t>(sources->size());
  scratch->filter_sources.Reserve(num_sources, task);
  scratch->filter_sources.Upload(sources->data(), num_sources, stream, task);
}

}  // namespace

PlaneMap FilterOnGpu(DeviceResources* device, const FilterInput& input, const FilterOptions& options) {
  const PlaneMap& map = *input.reference.map;
  const Task task{"consistency filter", input.reference.view->name, map.width(), map.height()};
  const FilterContext context(input, options);
  const std::int64_t num_pixels = static_cast<std::int64_t>(map.size());

  ScratchPool::Lease scratch(&device->scratch, task);
  const cudaStream_t stream = scratch->stream.get();
  device->images.KeepAtMost(0);
  device->depths.KeepAtMost(0);
  device->maps.KeepAtMost(input.sources.size() +
                          2);  // of 16 bytes a pixel; concurrent calls share most of them
  scratch->estimation.FreeDeviceMaps();
  scratch->inference.FreeDeviceMaps();
  std::vector<MapHandle> handles = {device->maps.Get(input.reference.map, stream, task)};
  std::vector<FilterSource> sources;
  FilterLaunch launch{context.reference,
                      context.thresholds,
                      context.min_num_consistent,
                      context.min_num_consistent_inferred,
                      context.max_cost,
                      handles.front()->View(),
                      {},
                      {},
                      nullptr,
                      0};
  UploadSources(device, input, context, scratch.get(), task, &sources, &handles);
  launch.sources = scratch->filter_sources.data();
  launch.num_sources = static_cast<int>(sources.size());
  if (context.cost.data != nullptr) {
    scratch->cost.Reserve(num_pixels, task);
    scratch->cost.Upload(context.cost.data, num_pixels, stream, task);
    launch.cost = scratch->cost.View(map.width(), map.height());
  }
  if (context.filled.data != nullptr) {
    scratch->filled.Reserve(num_pixels, task);
    scratch->filled.Upload(context.filled.data, num_pixels, stream, task);
    launch.filled = scratch->filled.View(map.width(), map.height());
  }

  scratch->keep.Reserve(num_pixels, task);
  scratch->begin.Record(stream, task);
  LaunchFilter(launch, scratch->keep.View(map.width(), map.height()), stream, task);
  scratch->end.Record(stream, task);
  scratch->host_mask.Download(scratch->keep, num_pixels, stream, task);
  device->NoteMemory(task);
  scratch->stream.Synchronize(task);
  device->times.Add(DeviceTimes::kFilter, scratch->begin, scratch->end, 0, task);
  return KeptPixels(map, scratch->host_mask.data());
}

}  // namespace phi::gpu

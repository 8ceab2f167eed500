// The consistency filter of one reference map: maps come from the cache, a mask of kept pixels goes back.
#include <algorithm>
#include <memory>
#include <vector>

#include "cuda/device_resources.h"
#include "cuda/filtering_kernels.h"
#include "cuda/memory_plan.h"
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

// The source views that have a map, with where they stand to the reference.
struct Sources {
  std::vector<std::shared_ptr<const PlaneMap>> maps;
  const std::vector<RelativeView>& views;

  Sources(const FilterInput& input, const FilterContext& context) : views(context.views) {
    for (const ViewMap& source : input.sources) {
      if (source.map != nullptr) maps.push_back(source.map);
    }
  }
};

// Sources `begin` to before `end`, from the cache to the launch. The handles keep them alive.
std::vector<MapHandle> BindSources(DeviceResources* device, const Sources& sources, std::size_t begin,
                                   std::size_t end, Scratch* scratch, const Task& task,
                                   FilterLaunch* launch) {
  const cudaStream_t stream = scratch->stream.get();
  std::vector<MapHandle> handles;
  std::vector<FilterSource> bound;
  for (std::size_t j = begin; j < end; ++j) {
    handles.push_back(device->maps.Get(sources.maps[j], stream, task));
    bound.push_back({sources.views[j], handles.back()->View()});
  }
  const std::int64_t count = static_cast<std::int64_t>(bound.size());
  scratch->filter_sources.Reserve(count, task);
  scratch->filter_sources.Upload(bound.data(), count, stream, task);
  launch->sources = scratch->filter_sources.data();
  launch->num_sources = static_cast<int>(count);
  launch->is_first = begin == 0;
  launch->is_last = end == sources.maps.size();
  return handles;
}

// What the reference view has beside its map.
void BindCostAndFilled(const FilterContext& context, std::int64_t num_pixels, Scratch* scratch,
                       const Task& task, FilterLaunch* launch) {
  const cudaStream_t stream = scratch->stream.get();
  if (context.cost.data != nullptr) {
    scratch->cost.Reserve(num_pixels, task);
    scratch->cost.Upload(context.cost.data, num_pixels, stream, task);
    launch->cost = scratch->cost.View(task.width, task.height);
  }
  if (context.filled.data != nullptr) {
    scratch->filled.Reserve(num_pixels, task);
    scratch->filled.Upload(context.filled.data, num_pixels, stream, task);
    launch->filled = scratch->filled.View(task.width, task.height);
  }
}

}  // namespace

PlaneMap FilterOnGpu(DeviceResources* device, const FilterInput& input, const FilterOptions& options) {
  const PlaneMap& map = *input.reference.map;
  const Task task{"consistency filter", input.reference.view->name, map.width(), map.height()};
  const FilterContext context(input, options);
  const std::int64_t num_pixels = static_cast<std::int64_t>(map.size());
  const FilterPlan plan = PlanFilter(input, device->budget.bytes(), task);

  const MemoryBudget::Lease lease(&device->budget, plan.bytes);
  ScratchPool::Lease scratch(&device->scratch, task);
  const cudaStream_t stream = scratch->stream.get();
  const std::size_t at_once = static_cast<std::size_t>(plan.num_sources_at_once);
  // Concurrent calls share most of the maps.
  device->KeepOnly({.maps = at_once + device->NumCallsAtOnce(plan.bytes)});
  scratch->estimation.FreeDeviceMaps();
  scratch->inference.FreeDeviceMaps();
  const MapHandle reference = device->maps.Get(input.reference.map, stream, task);
  FilterLaunch launch{.reference = context.reference,
                      .thresholds = context.thresholds,
                      .min_num_consistent = context.min_num_consistent,
                      .min_num_consistent_inferred = context.min_num_consistent_inferred,
                      .max_cost = context.max_cost,
                      .map = reference->View()};
  BindCostAndFilled(context, num_pixels, scratch.get(), task, &launch);
  scratch->keep.Reserve(num_pixels, task);
  const ArrayView2D<std::uint8_t> keep = scratch->keep.View(map.width(), map.height());

  const Sources sources(input, context);
  for (std::size_t begin = 0; begin == 0 || begin < sources.maps.size(); begin += at_once) {
    const std::size_t end = std::min(begin + at_once, sources.maps.size());
    const std::vector<MapHandle> handles =
        BindSources(device, sources, begin, end, scratch.get(), task, &launch);
    if (launch.is_first) scratch->begin.Record(stream, task);
    LaunchFilter(launch, keep, stream, task);
    if (!launch.is_last) scratch->stream.Synchronize(task);  // before the maps go
  }
  scratch->end.Record(stream, task);
  scratch->host_mask.Download(scratch->keep, num_pixels, stream, task);
  device->NoteMemory(task);
  scratch->stream.Synchronize(task);
  device->times.Add(DeviceTimes::kFilter, scratch->begin, scratch->end, 0, task);
  return KeptPixels(map, scratch->host_mask.data());
}

}  // namespace phi::gpu

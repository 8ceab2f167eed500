// The consistency filter of one reference map, and the judgement of an estimate: maps come from the cache, verdicts or states go back.
#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "cuda/calls_on_gpu.h"
#include "cuda/filtering_kernels.h"
#include "cuda/judging_kernels.h"
#include "cuda/memory_plan.h"
#include "phi/filtering/filter_setup.h"
#include "phi/filtering/judge_measurements.h"

namespace phi::gpu {
namespace {

using MapHandle = std::shared_ptr<const DeviceMap>;

// The device's copy of the reference's arrays. `scratch` holds what is beside the map.
FilterReference BindReference(const FilterReference& on_host, ArrayView2D<const PlaneHypothesis> map,
                              StagingPool* staging, Scratch* scratch, const Task& task) {
  FilterReference f = on_host;
  f.map = map;
  if (f.cost.data != nullptr) {
    scratch->cost.Reserve(map.size(), task);
    staging->Upload(on_host.cost.data, map.size(), scratch->cost.data(), task);
    f.cost = scratch->cost.View(task.width, task.height);
  }
  if (f.states.data != nullptr) {
    scratch->states.Reserve(map.size(), task);
    staging->Upload(on_host.states.data, map.size(), scratch->states.data(), task);
    f.states = scratch->states.View(task.width, task.height);
  }
  return f;
}

// What comes back keeps the sources' maps alive.
std::vector<MapHandle> BindTurn(DeviceResources* device, const SceneView& reference, std::span<const SourceMap> sources, Scratch* scratch,
                  const Task& task, FilterTurn* turn) {
  const cudaStream_t stream = scratch->stream.get();
  std::vector<MapHandle> handles;
  std::vector<FilterSource> bound;
  std::size_t num_masks = 0;
  for (const SourceMap& source : sources) {
    handles.push_back(device->maps.Get(PlanesOf(source.load()), stream));
    bound.push_back({MakeRelativeView(reference.camera, source.view->camera), handles.back()->View()});
    const std::shared_ptr<const ImageMask> mask = source.load_mask ? source.load_mask() : nullptr;
    if (mask == nullptr) continue;
    if (scratch->masks.size() == num_masks) scratch->masks.emplace_back();
    scratch->masks[num_masks].Upload(*mask, &device->staging, task);
    bound.back().mask = scratch->masks[num_masks++].View();
  }
  const std::int64_t count = static_cast<std::int64_t>(bound.size());
  scratch->filter_sources.Reserve(count, task);
  scratch->filter_sources.Upload(bound.data(), count, stream, task);
  turn->sources = scratch->filter_sources.data();
  turn->num_sources = static_cast<int>(count);
  return handles;
}

// A judgement on the device, but for what the kernels fill.
struct JudgementOnDevice {
  std::shared_ptr<const GrayPyramid> image;
  JudgementReference reference;
  OwnTextureArrays own_texture;
};

JudgementOnDevice BindJudgement(DeviceResources* device, const Judgement& judgement, ArrayView2D<const PlaneHypothesis> estimate,
                                Scratch* scratch, const Task& task) {
  const cudaStream_t stream = scratch->stream.get();
  JudgementScratch& buffers = scratch->judgement;
  JudgementOnDevice j;
  j.image = device->images.Get(judgement.image, stream);
  buffers.sums.Reserve(estimate.size(), task);
  buffers.is_plain.Reserve(estimate.size(), task);
  scratch->states.Reserve(estimate.size(), task);
  const std::vector<RelativeView>& sources = judgement.precision.sources();
  const auto num_sources = static_cast<std::int64_t>(sources.size());
  buffers.sources.Reserve(std::max<std::int64_t>(num_sources, 1), task);
  buffers.sources.Upload(sources.data(), num_sources, stream, task);
  j.own_texture = {buffers.sums.View(task.width, task.height), buffers.is_plain.View(task.width, task.height)};
  j.reference = MakeJudgementReference(judgement);
  j.reference.sources = buffers.sources.data();
  j.reference.estimate = estimate;
  j.reference.sums = j.own_texture.sums;
  if (judgement.rules.IsOn(Rule::kOwnTexture)) j.reference.is_plain = j.own_texture.is_plain;
  return j;
}

// Of each pixel what the last kernel made. The device is done with the call then.
template <typename Pixel>
const Pixel* Download(DeviceResources* device, const DeviceBuffer<Pixel>& pixels, std::int64_t count, Scratch* scratch,
                      PinnedBuffer<Pixel>* host, const Task& task) {
  scratch->end.Record(scratch->stream.get(), task);
  host->Download(pixels, count, scratch->stream.get(), task);
  device->NoteMemory(task);
  scratch->stream.Synchronize(task);
  return host->data();
}

// Of an estimate, by all that the sources said.
MeasurementMap Judged(DeviceResources* device, const PlaneMap& estimate, const FilterReference& filter, const JudgementOnDevice& j,
                      Scratch* scratch, const Task& task) {
  const cudaStream_t stream = scratch->stream.get();
  LaunchOwnTexture(j.reference, {j.image->level(0).get()}, j.own_texture, stream, task);
  LaunchMeasure(filter, j.reference, scratch->testimonies.View(task.width, task.height), scratch->states.View(task.width, task.height),
                stream, task);
  return JudgedPixels(estimate, Download(device, scratch->states, filter.map.size(), scratch, &scratch->host_states, task));
}

// What the filter keeps, not judged.
MeasurementMap Kept(DeviceResources* device, const MeasurementMap& map, const FilterReference& reference, Scratch* scratch,
                    const Task& task) {
  const std::int64_t num_pixels = reference.map.size();
  scratch->verdicts.Reserve(num_pixels, task);
  LaunchJudge(reference, scratch->testimonies.View(task.width, task.height), scratch->verdicts.View(task.width, task.height),
              scratch->stream.get(), task);
  return KeptPixels(map, Download(device, scratch->verdicts, num_pixels, scratch, &scratch->host_verdicts, task));
}

}  // namespace

MeasurementMap FilterOnGpu(DeviceResources* device, const FilterInput& input, const FilterOptions& options) {
  const MeasurementMap& map = *input.reference.map;
  const Task task{"consistency filter", input.reference.view->name, map.width(), map.height()};
  const std::int64_t num_pixels = static_cast<std::int64_t>(map.size());
  const FilterPlan plan = PlanFilter(input, device->budget.bytes(), task);

  const MemoryBudget::Lease lease(&device->budget, plan.bytes);
  ScratchPool<Scratch>::Lease scratch(&device->scratch, task);
  const cudaStream_t stream = scratch->stream.get();
  const std::size_t at_once = static_cast<std::size_t>(plan.num_sources_at_once);
  // Concurrent calls share most of the maps.
  const std::size_t num_calls = device->NumCallsAtOnce(plan.bytes);
  device->MakeRoom(CallKind::kFilter, plan.bytes, {.images = input.judgement ? num_calls : 0, .maps = at_once + num_calls}, scratch.get());
  const MapHandle reference = device->maps.Get(PlanesOf(input.reference.map), stream);
  FilterLaunch launch{
      BindReference(MakeFilterReference(input, options), reference->View(), &device->staging, scratch.get(), task), {}};
  std::optional<JudgementOnDevice> judgement;
  if (input.judgement) judgement = BindJudgement(device, *input.judgement, reference->View(), scratch.get(), task);
  scratch->testimonies.Reserve(num_pixels, task);
  const ArrayView2D<Testimonies> testimonies = scratch->testimonies.View(map.width(), map.height());
  ClearOnDevice(testimonies.data, num_pixels, stream, task);

  const std::vector<SourceMap> sources = SourcesWithMap(input);
  std::vector<MapHandle> handles;  // of the turn under way: the last one's go when the device has ended
  for (std::size_t begin = 0; begin == 0 || begin < sources.size(); begin += at_once) {
    const std::size_t end = std::min(begin + at_once, sources.size());
    const std::span<const SourceMap> of_turn = std::span(sources).subspan(begin, end - begin);
    handles = BindTurn(device, *input.reference.view, of_turn, scratch.get(), task, &launch.turn);
    if (begin == 0) scratch->begin.Record(stream, task);
    LaunchAskSources(launch, testimonies, stream, task);
    if (end == sources.size()) break;
    scratch->stream.Synchronize(task);
    handles.clear();
  }
  MeasurementMap kept = judgement ? Judged(device, map.planes, launch.reference, *judgement, scratch.get(), task)
                                  : Kept(device, map, launch.reference, scratch.get(), task);
  device->times.Add(CallKind::kFilter, scratch->begin, scratch->end, 0, task);
  return kept;
}

}  // namespace phi::gpu

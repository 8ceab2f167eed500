// The sharing of hypotheses for one image: maps come from the cache, sources and bands of rows take turns where memory is short.
#include <algorithm>
#include <memory>
#include <vector>

#include "cuda/bind_images.h"
#include "cuda/calls_on_gpu.h"
#include "cuda/memory_plan.h"
#include "cuda/sharing_kernels.h"
#include "phi/base/cancellation.h"
#include "phi/base/whole_array.h"
#include "phi/matching/estimation_setup.h"

namespace phi::gpu {
namespace {

using MapHandle = std::shared_ptr<const DeviceMap>;

class SharingOnGpu {
 public:
  SharingOnGpu(DeviceResources* device, const SharingInput& input, const StereoOptions& options,
               const SharingPlan& plan, Scratch* scratch, const Task& task)
      : device_(device),
        input_(input),
        plan_(plan),
        scratch_(scratch),
        stream_(scratch->stream.get()),
        task_(task) {
    launch_.parameters = matching_.parameters = MakeEstimationParameters(input.estimation, options);
  }

  // What all bands read.
  void Upload() {
    images_ = UploadImages(device_, input_.estimation, stream_);
    own_ = device_->maps.Get(PlanesOf(input_.own.map), stream_);
    BindTextures(images_, input_.estimation, 0, &matching_);
    BindSampleCount(scratch_, stream_, task_, &matching_);
    const std::int64_t num_pixels = static_cast<std::int64_t>(task_.width) * task_.height;
    scratch_->window_scales.Reserve(num_pixels, task_);
    matching_.window_scales = scratch_->window_scales.View(task_.width, task_.height);
    matching_.end_row = task_.height;
    LaunchWindowScales(matching_, stream_, task_);
    const std::int64_t num_band_pixels = static_cast<std::int64_t>(plan_.band_rows) * task_.width;
    scratch_->plane.Reserve(num_band_pixels, task_);
    scratch_->sharing.leads.Reserve(num_band_pixels, task_);
    scratch_->sharing.nearest.Reserve(num_band_pixels, task_);
    scratch_->host_plane.Reserve(num_pixels, task_);
  }

  void Run() {
    for (int first = 0; first < task_.height; first += plan_.band_rows) {
      ThrowIfCancelled();
      ShareBand(first, std::min(first + plan_.band_rows, task_.height));
    }
    scratch_->end.Record(stream_, task_);
  }

 private:
  void ShareBand(int first, int end) {
    const std::int64_t offset = static_cast<std::int64_t>(first) * task_.width;
    const std::int64_t count = static_cast<std::int64_t>(end - first) * task_.width;
    ClearOnDevice(scratch_->plane.data(), count, stream_, task_);
    ClearOnDevice(scratch_->sharing.leads.data(), count, stream_, task_);
    launch_.offers = {own_->View(),
                      {scratch_->plane.data() - offset, task_.width, task_.height},
                      {scratch_->sharing.leads.data() - offset, task_.width, task_.height}};
    launch_.nearest = {scratch_->sharing.nearest.data() - offset, task_.width, task_.height};
    launch_.first_row = matching_.first_row = first;
    launch_.end_row = matching_.end_row = end;
    HearSources(first == 0);
    LaunchChoosePlanes(matching_, launch_.offers, stream_, task_);
    CopyToHost(scratch_->host_plane.data() + offset, scratch_->plane.data(), count, stream_, task_);
  }

  void HearSources(bool is_first_band) {
    const std::size_t count = input_.sources.size(),
                      at_once = static_cast<std::size_t>(plan_.num_sources_at_once);
    for (std::size_t begin = 0; begin == 0 || begin < count; begin += at_once) {
      if (!maps_.empty()) scratch_->stream.Synchronize(task_);
      maps_.clear();
      const std::size_t end = std::min(begin + at_once, count);
      for (std::size_t j = begin; j < end; ++j)
        maps_.push_back(device_->maps.Get(PlanesOf(input_.sources[j].load()), stream_));
      if (is_first_band && begin == 0) scratch_->begin.Record(stream_, task_);
      for (std::size_t j = begin; j < end; ++j)
        LaunchHearSource(launch_, Offering(j, *maps_[j - begin]), stream_, task_);
    }
  }

  OfferingSource Offering(std::size_t source, const DeviceMap& map) const {
    const Camera& camera = input_.sources[source].view->camera;
    return {MakeRelativeView(camera, input_.own.view->camera), MakeRayModel(camera.pinhole), map.View()};
  }

  DeviceResources* device_;
  const SharingInput& input_;
  const SharingPlan& plan_;
  Scratch* scratch_;
  const cudaStream_t stream_;
  const Task& task_;
  SharingLaunch launch_;
  EstimationLaunch matching_;
  std::vector<ImageHandle> images_;
  MapHandle own_;
  std::vector<MapHandle> maps_;  // of the sources whose kernels may be under way
};

}  // namespace

std::shared_ptr<const MeasurementMap> ShareOnGpu(DeviceResources* device, const SharingInput& input,
                                                 const StereoOptions& options) {
  const EstimationInput& estimation = input.estimation;
  CheckEstimationInput(estimation);
  const Pinhole& size = input.own.view->camera.pinhole;
  const Task task{"sharing of hypotheses", input.own.view->name, size.width, size.height};
  const SharingPlan plan = PlanSharing(input, device->budget.bytes(), task);

  const MemoryBudget::Lease lease(&device->budget, plan.bytes);
  ScratchPool<Scratch>::Lease scratch(&device->scratch, task);
  const cudaStream_t stream = scratch->stream.get();
  const std::size_t num_calls = device->NumCallsAtOnce(plan.bytes);
  const CacheSizes sizes = {.images = num_calls * (estimation.sources.size() + 1),
                            .maps = num_calls + static_cast<std::size_t>(plan.num_sources_at_once)};
  device->MakeRoom(CallKind::kSharing, plan.bytes, sizes, scratch.get());
  SharingOnGpu sharing(device, input, options, plan, scratch.get(), task);
  sharing.Upload();

  ThrowIfCancelled();
  sharing.Run();
  scratch->host_num_samples.Download(scratch->num_samples, 1, stream, task);
  device->NoteMemory(task);
  const auto shared =
      std::make_shared<MeasurementMap>(MeasurementMap{PlaneMap::Uninitialized(size.width, size.height), {}});
  scratch->stream.Synchronize(task);
  CopyAll(scratch->host_plane.data(), shared->planes.size(), shared->planes.data());
  // The filter reads it next, of this image and of those around it.
  if (plan.band_rows == size.height) {
    device->maps.GetOrMake(PlanesOf(shared), [&](DeviceMap* copy) {
      copy->Copy(scratch->plane.View(size.width, size.height), stream, task);
    });
  }
  device->times.Add(CallKind::kSharing, scratch->begin, scratch->end,
                    static_cast<double>(*scratch->host_num_samples.data()), task);
  return shared;
}

}  // namespace phi::gpu

// The estimation of one reference image: uploads, launches, one synchronisation, download.
#include <cstring>
#include <memory>
#include <vector>

#include "cuda/bind_images.h"
#include "cuda/calls_on_gpu.h"
#include "cuda/estimation_in_bands.h"
#include "cuda/memory_plan.h"
#include "phi/base/cancellation.h"
#include "phi/base/whole_array.h"
#include "phi/matching/coarse_start.h"
#include "phi/matching/estimation_setup.h"
#include "phi/nearest_point_ranges.h"

namespace phi::gpu {
namespace {

// Gives up what an estimation does not use; see DeviceResources.
void PrepareMemory(DeviceResources* device, Scratch* scratch, const EstimationPlan& plan,
                   std::size_t num_sources) {
  const std::size_t num_calls = device->NumCallsAtOnce(plan.bytes);
  device->MakeRoom(CallKind::kEstimation, plan.bytes, {.images = num_calls * (num_sources + 1)}, scratch);
}

// Room for the state of the whole image, of its coarser parts, and the scales of its windows.
void ReserveState(Scratch* scratch, const EstimationPlan& plan, const Task& task) {
  const std::int64_t num_pixels = static_cast<std::int64_t>(task.width) * task.height;
  scratch->window_scales.Reserve(num_pixels, task);
  scratch->estimation.changed.Reserve(num_pixels, task);
  scratch->estimation.coarse_plane.Reserve(plan.num_coarse_pixels, task);
  scratch->estimation.notes.Reserve(NumHalfPassNotes(task.width, plan.band_rows > 0 ? plan.band_rows : task.height), task);
  if (plan.band_rows > 0) return;
  scratch->plane.Reserve(num_pixels, task);
  scratch->cost.Reserve(num_pixels, task);
}

void BindState(const Scratch& scratch, const DepthRanges& ranges, EstimationLaunch* launch) {
  const int width = launch->parameters.reference.width, height = launch->parameters.reference.height;
  launch->notes = scratch.estimation.notes.data();
  launch->window_scales = scratch.window_scales.View(width, height);
  launch->state = {scratch.plane.View(width, height),
                   scratch.cost.View(width, height),
                   scratch.estimation.changed.View(width, height),
                   ranges};
}

ArrayView2D<const DepthRange> UploadRanges(Scratch* scratch, const EstimationInput& coarsest,
                                           const Task& task) {
  const Pinhole& size = coarsest.reference.view->camera.pinhole;
  const DepthRangeMap ranges = NearestPointDepthRanges(coarsest.sparse, size.width, size.height);
  const std::int64_t num_cells = static_cast<std::int64_t>(ranges.size());
  scratch->estimation.ranges.Reserve(num_cells, task);
  scratch->estimation.ranges.Upload(ranges.data(), num_cells, scratch->estimation.stream.get(), task);
  return scratch->estimation.ranges.View(ranges.width(), ranges.height());
}

// One call's parts, coarse to fine: they share images, buffers and the stream. Nothing waits for the device between them
// where the whole state is on it.
class PartsOnGpu {
 public:
  PartsOnGpu(const EstimationInput& input, const StereoOptions& options, const EstimationPlan& plan,
             std::vector<EstimationPart> parts, Scratch* scratch, const Task& task)
      : input_(input),
        options_(options),
        parts_(std::move(parts)),
        plan_(plan),
        scratch_(scratch),
        task_(task) {}

  // What all parts read.
  void Upload(DeviceResources* device) {
    ReserveState(scratch_, plan_, task_);
    BindSampleCount(scratch_, scratch_->estimation.stream.get(), task_, &launch_);
    images_ = UploadImages(device, input_, scratch_->stream.get());  // others may wait for these copies
    ranges_.cells = UploadRanges(scratch_, PartInput(input_, options_, parts_.front()).input(), task_);
  }

  void Launch() {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (i > 0) StartFromCoarse(parts_[i - 1].level - parts_[i].level);
      LaunchPart(parts_[i]);
    }
  }

 private:
  bool IsWhole() const { return plan_.band_rows == 0; }

  void LaunchPart(const EstimationPart& part) {
    const PartInput of_part(input_, options_, part);
    launch_.parameters = of_part.Parameters();
    launch_.end_row = launch_.parameters.reference.height;
    // The cells of the coarsest part cover more pixels of a finer one.
    ranges_.cell = kDepthRangeCell << (parts_.front().level - part.level);
    BindTextures(images_, of_part.input(), part.level, &launch_);
    BindState(*scratch_, ranges_, &launch_);
    LaunchWindowScales(launch_, scratch_->estimation.stream.get(), task_);
    if (IsWhole()) {
      EstimateWhole();
    } else {
      EstimateByBands();
    }
  }

  template <class Function>
  void ForEachHalfPass(const Function& half_pass) const {
    const EstimationParameters& p = launch_.parameters;
    for (int iteration = p.first_iteration; iteration < p.end_iteration; ++iteration) {
      for (const int colour : {0, 1}) half_pass(iteration, colour);
    }
  }

  void EstimateWhole() {
    const cudaStream_t stream = scratch_->estimation.stream.get();
    LaunchInitialization(launch_, coarse_, stream, task_);
    ForEachHalfPass(
        [&](int iteration, int colour) { LaunchHalfPass(launch_, iteration, colour, stream, task_); });
  }

  void EstimateByBands() {
    EstimationInBands estimation(launch_, plan_.band_rows, scratch_, task_);
    estimation.Initialize(coarse_, host_coarse_.empty() ? nullptr : &host_coarse_);
    ForEachHalfPass([&](int iteration, int colour) { estimation.HalfPass(iteration, colour); });
  }

  // What the last part found becomes the start of the next one, whose image is 2^shift times larger.
  void StartFromCoarse(int shift) {
    coarse_.shift = shift;
    const ArrayView2D<PlaneHypothesis> found = launch_.state.plane;
    if (IsWhole()) {
      const DeviceBuffer<PlaneHypothesis>& kept = scratch_->estimation.coarse_plane;
      CopyOnDevice(kept.data(), found.data, found.size(), scratch_->estimation.stream.get(), task_);
      coarse_.map = kept.View(found.width, found.height);
    } else {
      scratch_->estimation.stream.Synchronize(task_);
      host_coarse_ = PlaneMap(found.width, found.height);
      std::memcpy(host_coarse_.data(), scratch_->host_plane.data(), host_coarse_.bytes());
    }
  }

  const EstimationInput& input_;
  const StereoOptions& options_;
  const std::vector<EstimationPart> parts_;
  const EstimationPlan& plan_;
  Scratch* scratch_;
  const Task& task_;
  EstimationLaunch launch_;  // of the part at hand
  CoarseHypotheses coarse_;  // what the part before found
  DepthRanges ranges_;
  std::vector<ImageHandle> images_;
  PlaneMap host_coarse_;  // in bands: what the coarser part found
};

// Waits for the device.
EstimationResult TakeResult(const Scratch& scratch, const Task& task) {
  EstimationResult result{PlaneMap::Uninitialized(task.width, task.height), CostMap::Uninitialized(task.width, task.height)};
  scratch.estimation.stream.Synchronize(task);
  CopyAll(scratch.host_plane.data(), result.map.size(), result.map.data());
  CopyAll(scratch.host_cost.data(), result.cost.size(), result.cost.data());
  return result;
}

}  // namespace

EstimationResult EstimateOnGpu(DeviceResources* device, const EstimationInput& input,
                               const StereoOptions& options) {
  CheckEstimationInput(input);
  const Pinhole& size = input.reference.view->camera.pinhole;
  const Task task{"estimation", input.reference.view->name, size.width, size.height};
  std::vector<EstimationPart> parts = EstimationParts(input, options);
  const EstimationPlan plan = PlanEstimation(input, device->budget.bytes(), task, parts.size() > 1);

  const MemoryBudget::Lease lease(&device->budget, plan.bytes);
  ScratchPool<Scratch>::Lease scratch(&device->scratch, task);
  const cudaStream_t stream = scratch->estimation.stream.get();
  PrepareMemory(device, scratch.get(), plan, input.sources.size());
  PartsOnGpu estimation(input, options, plan, std::move(parts), scratch.get(), task);
  estimation.Upload(device);

  ThrowIfCancelled();
  scratch->begin.Record(stream, task);
  estimation.Launch();
  scratch->end.Record(stream, task);
  if (plan.band_rows == 0) {
    const std::int64_t num_pixels = static_cast<std::int64_t>(size.width) * size.height;
    scratch->host_plane.Download(scratch->plane, num_pixels, stream, task);
    scratch->host_cost.Download(scratch->cost, num_pixels, stream, task);
  }
  scratch->host_num_samples.Download(scratch->num_samples, 1, stream, task);
  device->NoteMemory(task);
  EstimationResult result = TakeResult(*scratch.get(), task);
  const double num_samples = static_cast<double>(*scratch->host_num_samples.data());
  device->times.Add(CallKind::kEstimation, scratch->begin, scratch->end, num_samples, task);
  return result;
}

}  // namespace phi::gpu

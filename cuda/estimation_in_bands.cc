#include "cuda/estimation_in_bands.h"

#include <algorithm>

#include "phi/base/cancellation.h"
#include "phi/matching/propagation.h"

namespace phi::gpu {

EstimationInBands::EstimationInBands(const EstimationLaunch& launch, int band_rows, Scratch* scratch,
                                     const Task& task)
    : launch_(launch),
      width_(launch.parameters.reference.width),
      height_(launch.parameters.reference.height),
      band_rows_(band_rows),
      scratch_(scratch),
      task_(task) {
  const std::int64_t num_pixels = static_cast<std::int64_t>(width_) * height_;
  scratch->host_plane.Reserve(num_pixels, task);
  scratch->host_cost.Reserve(num_pixels, task);
  const std::int64_t read = static_cast<std::int64_t>(band_rows + 2 * kPropagationReach) * width_;
  scratch->plane.Reserve(read, task);
  scratch->cost.Reserve(read, task);
}

void EstimationInBands::Initialize(CoarseHypotheses coarse, const PlaneMap* found) {
  ForEachBand([&](const Band& band) {
    if (found != nullptr) coarse.map = UploadCoarse(*found, coarse.shift, band);
    LaunchInitialization(Bind(band), coarse, scratch_->estimation.stream.get(), task_);
    CopyNeighbourRows(band, band.first, band.end, Direction::kToHost);
  });
}

ArrayView2D<const PlaneHypothesis> EstimationInBands::UploadCoarse(const PlaneMap& coarse, int shift,
                                                                   const Band& band) {
  const int first = band.first >> shift, end = ((band.end - 1) >> shift) + 1;
  const std::int64_t offset = static_cast<std::int64_t>(first) * coarse.width();
  const DeviceBuffer<PlaneHypothesis>& rows = scratch_->estimation.coarse_plane;
  rows.Upload(coarse.data() + offset, static_cast<std::int64_t>(end - first) * coarse.width(),
              scratch_->estimation.stream.get(), task_);
  return {rows.data() - offset, coarse.width(), coarse.height()};
}

void EstimationInBands::HalfPass(int iteration, int colour) {
  ForEachBand([&](const Band& band) {
    CopyNeighbourRows(band, band.first_read, band.end_read, Direction::kToDevice);
    LaunchHalfPass(Bind(band), iteration, colour, scratch_->estimation.stream.get(), task_);
    CopyNeighbourRows(band, band.first, band.end, Direction::kToHost);
  });
}

template <class Function>
void EstimationInBands::ForEachBand(const Function& function) {
  for (int first = 0; first < height_; first += band_rows_) {
    ThrowIfCancelled();
    const int end = std::min(first + band_rows_, height_);
    function(
        Band{first, end, std::max(first - kPropagationReach, 0), std::min(end + kPropagationReach, height_)});
  }
}

EstimationLaunch EstimationInBands::Bind(const Band& band) const {
  EstimationLaunch launch = launch_;
  const std::int64_t read_offset = static_cast<std::int64_t>(band.first_read) * width_;
  launch.state.plane = {scratch_->plane.data() - read_offset, width_, height_};
  launch.state.cost = {scratch_->cost.data() - read_offset, width_, height_};
  launch.first_row = band.first;
  launch.end_row = band.end;
  return launch;
}

void EstimationInBands::CopyNeighbourRows(const Band& band, int first, int end, Direction direction) {
  const std::int64_t host = static_cast<std::int64_t>(first) * width_;
  const std::int64_t device = static_cast<std::int64_t>(first - band.first_read) * width_;
  const std::int64_t count = static_cast<std::int64_t>(end - first) * width_;
  const auto copy = [&](auto* host_data, auto* device_data) {
    const cudaStream_t stream = scratch_->estimation.stream.get();
    if (direction == Direction::kToDevice) {
      CopyToDevice(device_data + device, host_data + host, count, stream, task_);
    } else {
      CopyToHost(host_data + host, device_data + device, count, stream, task_);
    }
  };
  copy(scratch_->host_plane.data(), scratch_->plane.data());
  copy(scratch_->host_cost.data(), scratch_->cost.data());
}

}  // namespace phi::gpu

// Device memory, page-locked memory and a stream for one call at a time; kept between calls, grown as needed. A call may
// free what only other kinds of call use: that stops the device, but stages change rarely.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "cuda/buffer.h"
#include "cuda/estimation_kernels.h"
#include "cuda/filtering_kernels.h"
#include "cuda/inference_kernels.h"
#include "cuda/sharing_kernels.h"
#include "cuda/stream.h"

namespace phi::gpu {

struct InferenceScratch {
  // Elements a pixel and a node of the field.
  static constexpr std::int64_t kPixelFloats = kNumDirections + 3, kByteFields = 3,
                                kFloatFields = kMaxLabels + 2, kIntegerFields = 3 * kMaxLabels;
  // Device bytes a pixel, with those that Scratch holds for all kinds of call, and a node.
  static constexpr std::int64_t kPixelBytes =
      kPixelFloats * sizeof(float) + sizeof(PlaneHypothesis) + sizeof(PixelState);
  static constexpr std::int64_t kNodeBytes =
      kByteFields + kFloatFields * sizeof(float) + kIntegerFields * sizeof(std::int32_t);

  DeviceBuffer<InferenceSource> sources;
  DeviceBuffer<float> inverse_depths;
  DeviceBuffer<std::uint8_t> node_bytes;
  DeviceBuffer<float> node_floats;
  DeviceBuffer<std::int32_t> node_integers, tables;
  DeviceBuffer<std::int64_t> totals;
  PinnedBuffer<std::int64_t> host_totals;

  void FreeDeviceMaps() {
    inverse_depths.Free();
    node_bytes.Free();
    node_floats.Free();
    node_integers.Free();
  }
};

struct EstimationScratch {
  DeviceBuffer<std::uint8_t> changed;
  DeviceBuffer<PlaneHypothesis> coarse_plane;  // what a coarser part found
  DeviceBuffer<HalfPassNote> notes;
  DeviceBuffer<DepthRange> ranges;

  void FreeDeviceMaps() {
    changed.Free();
    coarse_plane.Free();
    notes.Free();
  }
};

struct SharingScratch {
  // Device bytes a pixel of a band, with those that Scratch holds for all kinds of call.
  static constexpr std::int64_t kBandPixelBytes =
      sizeof(PlaneHypothesis) + sizeof(std::uint8_t) + sizeof(NearestPixel);

  DeviceBuffer<std::uint8_t> leads;
  DeviceBuffer<NearestPixel> nearest;

  void FreeDeviceMaps() {
    leads.Free();
    nearest.Free();
  }
};

struct Scratch {
  explicit Scratch(const Task& task)
      : stream(task), begin(Event::Timing::kOn, task), end(Event::Timing::kOn, task) {}

  Stream stream;
  Event begin, end;  // around the kernels
  DeviceBuffer<PlaneHypothesis> plane;
  DeviceBuffer<float> cost;
  DeviceBuffer<std::uint8_t> window_scales;  // of estimation and sharing
  DeviceBuffer<unsigned long long> num_samples;
  DeviceBuffer<PixelState> states;
  DeviceBuffer<Testimonies> testimonies;
  DeviceBuffer<FilterVerdict> verdicts;
  DeviceBuffer<FilterSource> filter_sources;
  EstimationScratch estimation;
  SharingScratch sharing;
  InferenceScratch inference;
  PinnedBuffer<PlaneHypothesis> host_plane;
  PinnedBuffer<float> host_cost;
  PinnedBuffer<unsigned long long> host_num_samples;
  PinnedBuffer<PixelState> host_states;
  PinnedBuffer<FilterVerdict> host_verdicts;
  PinnedBuffer<Testimonies> host_testimonies;
};

// Lends scratch to concurrent calls; makes a new one when all are lent.
class ScratchPool {
 public:
  class Lease {
   public:
    Lease(ScratchPool* pool, const Task& task) : pool_(pool), scratch_(pool->Take(task)) {}
    // Copies of a call that failed may still read its inputs: wait for them.
    ~Lease() {
      cudaStreamSynchronize(scratch_->stream.get());
      pool_->Return(std::move(scratch_));
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    Scratch* get() const { return scratch_.get(); }
    Scratch* operator->() const { return scratch_.get(); }

   private:
    ScratchPool* pool_;
    std::unique_ptr<Scratch> scratch_;
  };

  // Frees what is not lent.
  void FreeIdle() {
    std::lock_guard<std::mutex> lock(mutex_);
    free_.clear();
  }
  // The same for the large ones on the device alone.
  void FreeIdleDeviceMaps() {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const std::unique_ptr<Scratch>& idle : free_) {
      idle->estimation.FreeDeviceMaps();
      idle->sharing.FreeDeviceMaps();
      idle->window_scales.Free();
      idle->inference.FreeDeviceMaps();
    }
  }

 private:
  std::unique_ptr<Scratch> Take(const Task& task) {
    std::lock_guard<std::mutex> lock(mutex_);
    if (free_.empty()) return std::make_unique<Scratch>(task);
    std::unique_ptr<Scratch> scratch = std::move(free_.back());
    free_.pop_back();
    return scratch;
  }
  void Return(std::unique_ptr<Scratch> scratch) {
    std::lock_guard<std::mutex> lock(mutex_);
    free_.push_back(std::move(scratch));
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<Scratch>> free_;
};

}  // namespace phi::gpu

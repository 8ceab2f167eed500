// What the calls on one device share: cached images and maps, scratch memory, measured times.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "cuda/buffer.h"
#include "cuda/device.h"
#include "cuda/device_cache.h"
#include "cuda/device_map.h"
#include "cuda/estimation_kernels.h"
#include "cuda/filtering_kernels.h"
#include "cuda/gray_texture.h"
#include "cuda/stream.h"
#include "phi/backend.h"

namespace phi::gpu {

// Memory and a stream for one call at a time; kept between calls, grown as needed.
struct Scratch {
  explicit Scratch(const Task& task)
      : stream(task), begin(Event::Timing::kOn, task), end(Event::Timing::kOn, task) {}

  Stream stream;
  Event begin, end;  // around the kernels
  DeviceBuffer<PlaneHypothesis> plane;
  DeviceBuffer<float> cost;
  DeviceBuffer<std::uint32_t> selected_views;
  DeviceBuffer<std::uint16_t> view_costs;
  DeviceBuffer<std::uint8_t> window_levels;
  DeviceBuffer<float2> ranges;
  DeviceBuffer<std::uint8_t> mask, filled;
  DeviceBuffer<GuidanceSource> guidance;
  DeviceBuffer<FilterSource> filter_sources;
  PinnedBuffer<PlaneHypothesis> host_plane;
  PinnedBuffer<float> host_cost;
  PinnedBuffer<std::uint8_t> host_mask;
};

// Lends scratch to concurrent calls; makes a new one when all are lent.
class ScratchPool {
 public:
  class Lease {
   public:
    Lease(ScratchPool* pool, const Task& task) : pool_(pool), scratch_(pool->Take(task)) {}
    ~Lease() { pool_->Return(std::move(scratch_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    Scratch* operator->() const { return scratch_.get(); }

   private:
    ScratchPool* pool_;
    std::unique_ptr<Scratch> scratch_;
  };

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

// Device seconds of the kernels of one stage, summed over images.
struct StageTime {
  int num_images = 0;
  double seconds = 0;
  double samples = 0;  // of source images for ZNCC
};

struct DeviceTimes {
  std::mutex mutex;
  StageTime estimation, filter;

  void Add(StageTime DeviceTimes::* stage, double seconds, double samples) {
    std::lock_guard<std::mutex> lock(mutex);
    (this->*stage).num_images += 1;
    (this->*stage).seconds += seconds;
    (this->*stage).samples += samples;
  }
};

struct DeviceResources {
  explicit DeviceResources(const DeviceProperties& properties);

  DeviceProperties properties;
  DeviceCache<GrayImage, GrayPyramid> images;
  DeviceCache<PlaneMap, DeviceMap> maps;
  ScratchPool scratch;
  DeviceTimes times;
};

EstimationResult EstimateOnGpu(DeviceResources* device, const EstimationInput& input, const StereoOptions& options);
PlaneMap FilterOnGpu(DeviceResources* device, const FilterInput& input, const FilterOptions& options);

}  // namespace phi::gpu

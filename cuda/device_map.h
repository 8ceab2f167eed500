// Plane maps on the device, whole or their depths alone (a quarter of the bytes, all that guidance reads).
#pragma once

#include <tbb/parallel_for.h>

#include "cuda/buffer.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi::gpu {

class DeviceMap {
 public:
  DeviceMap(const PlaneMap& map, cudaStream_t stream, const Task& task)
      : width_(map.width()), height_(map.height()), buffer_(static_cast<std::int64_t>(map.size()), task) {
    buffer_.Upload(map.data(), static_cast<std::int64_t>(map.size()), stream, task);
    // The host's map may go away once this returns: wait for the driver to have read it.
    Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize after a map's upload", task);
  }

  ArrayView2D<const PlaneHypothesis> View() const { return buffer_.View(width_, height_); }

 private:
  int width_, height_;
  DeviceBuffer<PlaneHypothesis> buffer_;
};

class DeviceDepths {
 public:
  DeviceDepths(const PlaneMap& map, cudaStream_t stream, const Task& task)
      : width_(map.width()), height_(map.height()), buffer_(static_cast<std::int64_t>(map.size()), task) {
    Array2D<float> depths(width_, height_);
    tbb::parallel_for(0, height_, [&](int y) {
      for (int x = 0; x < width_; ++x) depths(x, y) = map(x, y).depth;
    });
    buffer_.Upload(depths.data(), static_cast<std::int64_t>(depths.size()), stream, task);
    Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize after a depth map's upload", task);
  }

  ArrayView2D<const float> View() const { return buffer_.View(width_, height_); }

 private:
  int width_, height_;
  DeviceBuffer<float> buffer_;
};

}  // namespace phi::gpu

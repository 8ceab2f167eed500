// Plane maps and depth maps on the device.
#pragma once

#include <cstdint>

#include "cuda/buffer.h"
#include "cuda/staging.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/measurement.h"

namespace phi::gpu {

template <typename Pixel>
class DeviceArray2D {
 public:
  DeviceArray2D() = default;
  DeviceArray2D(const Array2D<Pixel>& map, StagingPool* staging, const Task& task) { Upload(map, staging, task); }

  // In the place of what was there; the memory stays where it is large enough. Returns once the map is there.
  void Upload(const Array2D<Pixel>& map, StagingPool* staging, const Task& task) {
    width_ = map.width();
    height_ = map.height();
    buffer_.Reserve(static_cast<std::int64_t>(map.size()), task);
    staging->Upload(map.data(), static_cast<std::int64_t>(map.size()), buffer_.data(), task);
  }

  // The same from memory of the device.
  void Copy(ArrayView2D<const Pixel> map, cudaStream_t stream, const Task& task) {
    width_ = map.width;
    height_ = map.height;
    buffer_.Reserve(map.size(), task);
    CopyOnDevice(buffer_.data(), map.data, map.size(), stream, task);
    Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize after a map's copy", task);
  }

  ArrayView2D<const Pixel> View() const { return buffer_.View(width_, height_); }

 private:
  int width_ = 0, height_ = 0;
  DeviceBuffer<Pixel> buffer_;
};

using DeviceMap = DeviceArray2D<PlaneHypothesis>;
using DeviceDepths = DeviceArray2D<float>;
using DeviceMask = DeviceArray2D<std::uint8_t>;

class DeviceMeasuredDepths {
 public:
  void Upload(const MeasuredDepths& map, StagingPool* staging, const Task& task) {
    depths_.Upload(map.depths, staging, task);
    states_.Upload(map.states, staging, task);
  }

  MeasuredDepthsView View() const { return {depths_.View(), states_.View()}; }

 private:
  DeviceDepths depths_;
  DeviceArray2D<PixelState> states_;
};

}  // namespace phi::gpu

// Device memory, page-locked memory and streams for one call of a backend at a time (ScratchPool); grown as needed. A call may
// free what only other kinds of call use: that stops the device, but stages change rarely.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "cuda/buffer.h"
#include "cuda/call_kind.h"
#include "cuda/device_map.h"
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
};

struct EstimationScratch {
  explicit EstimationScratch(const Task& task) : stream(task, Stream::Priority::kLow) {}

  // Its kernels keep the device busy for long. Calls of other kinds need it for a moment, and then the host goes on: they come first.
  Stream stream;
  DeviceBuffer<std::uint8_t> changed;
  DeviceBuffer<PlaneHypothesis> coarse_plane;  // what a coarser part found
  DeviceBuffer<HalfPassNote> notes;
  DeviceBuffer<DepthRange> ranges;
};

struct SharingScratch {
  // Device bytes a pixel of a band, with those that Scratch holds for all kinds of call.
  static constexpr std::int64_t kBandPixelBytes =
      sizeof(PlaneHypothesis) + sizeof(std::uint8_t) + sizeof(NearestPixel);

  DeviceBuffer<std::uint8_t> leads;
  DeviceBuffer<NearestPixel> nearest;
};

struct JudgementScratch {
  // Device bytes a pixel, with the new states that Scratch holds for all kinds of call.
  static constexpr std::int64_t kPixelBytes = sizeof(std::uint16_t) + sizeof(std::uint8_t) + sizeof(PixelState);

  DeviceBuffer<std::uint16_t> sums;
  DeviceBuffer<std::uint8_t> is_plain;
  DeviceBuffer<RelativeView> sources;
};

struct Scratch {
  explicit Scratch(const Task& task)
      : stream(task), begin(Event::Timing::kOn, task), end(Event::Timing::kOn, task), estimation(task) {}

  void Settle() const {
    stream.Settle();
    estimation.stream.Settle();
  }

  // Those on the device that grow with the image.
  void FreeDeviceMaps() {
    ForEachDeviceMap([](auto* buffer) { buffer->Free(); });
    masks.clear();
  }
  std::int64_t DeviceMapBytes() {
    std::int64_t sum = 0;
    ForEachDeviceMap([&](const auto* buffer) { sum += static_cast<std::int64_t>(buffer->bytes()); });
    return sum;
  }

  Stream stream;     // of all kinds of call but the estimation
  Event begin, end;  // around the kernels
  DeviceBuffer<PlaneHypothesis> plane;
  DeviceBuffer<float> cost;
  DeviceBuffer<std::uint8_t> window_scales;  // of estimation and sharing
  DeviceBuffer<unsigned long long> num_samples;
  DeviceBuffer<PixelState> states;
  DeviceBuffer<Testimonies> testimonies;
  DeviceBuffer<FilterVerdict> verdicts;
  DeviceBuffer<FilterSource> filter_sources;
  std::vector<DeviceMask> masks;  // of the filter's sources
  EstimationScratch estimation;
  SharingScratch sharing;
  JudgementScratch judgement;
  InferenceScratch inference;
  PinnedBuffer<PlaneHypothesis> host_plane;
  PinnedBuffer<float> host_cost;
  PinnedBuffer<unsigned long long> host_num_samples;
  PinnedBuffer<PixelState> host_states;
  PinnedBuffer<FilterVerdict> host_verdicts;
  std::optional<CallKind> last_use;

 private:
  template <typename Function>
  void ForEachDeviceMap(const Function& function) {
    const auto for_each = [&](auto*... buffers) { (function(buffers), ...); };
    for_each(&plane, &cost, &window_scales, &states, &testimonies, &verdicts);
    for_each(&estimation.changed, &estimation.coarse_plane, &estimation.notes);
    for_each(&sharing.leads, &sharing.nearest);
    for_each(&judgement.sums, &judgement.is_plain);
    for_each(&inference.inverse_depths, &inference.node_bytes, &inference.node_floats, &inference.node_integers);
  }
};

}  // namespace phi::gpu

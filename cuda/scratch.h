// Device memory, page-locked memory and a stream for one call of a backend at a time (ScratchPool); grown as needed. A call may
// free what only other kinds of call use: that stops the device, but stages change rarely.
#pragma once

#include <cstdint>
#include <optional>

#include "cuda/buffer.h"
#include "cuda/call_kind.h"
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

  // The large ones on the device, but for those that calls of the kind `kept` use.
  void FreeDeviceMaps(std::optional<CallKind> kept = std::nullopt) {
    if (kept != CallKind::kEstimation) estimation.FreeDeviceMaps();
    if (kept != CallKind::kSharing) sharing.FreeDeviceMaps();
    if (kept != CallKind::kEstimation && kept != CallKind::kSharing) window_scales.Free();
    if (kept != CallKind::kInference) inference.FreeDeviceMaps();
  }

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

}  // namespace phi::gpu

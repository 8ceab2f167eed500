#include "phi/inference/infer_holes.h"

#include <cstddef>

#include "phi/base/whole_array.h"

namespace phi {
namespace {

// In the place of what was inferred there.
void RestoreUnsure(const MeasurementMap& measured, MeasurementMap* inferred) {
  ForParts(measured.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (measured.states.data()[i] != PixelState::kUnsure) continue;
      inferred->planes.data()[i] = measured.planes.data()[i];
      inferred->states.data()[i] = PixelState::kMeasured;
    }
  });
}

}  // namespace

InferenceResult InferHoles(Backend& backend, const InferenceInput& input, const StereoOptions& stereo,
                           const InferenceOptions& options) {
  InferenceResult inferred = backend.Infer(input, stereo, options);
  RestoreUnsure(*input.measured, &inferred.map);
  if (input.mask != nullptr) DropMasked(*input.mask, &inferred.map);
  return inferred;
}

}  // namespace phi

#include "phi/inference/infer_holes.h"

#include <cmath>
#include <cstddef>

namespace phi {
namespace {

// A plane goes on where no hypothesis of the estimation could be.
void DropInferredOutside(float nearest, float farthest, MeasurementMap* map) {
  for (std::size_t i = 0; i < map->size(); ++i) {
    const float depth = map->planes.data()[i].depth;
    if (IsInferred(map->states.data()[i]) && !(depth >= nearest && depth <= farthest)) map->Drop(i);
  }
}

}  // namespace

InferenceResult InferHoles(Backend& backend, const InferenceInput& input, const StereoOptions& stereo,
                           const InferenceOptions& options) {
  InferenceResult inferred = backend.Infer(input, stereo, options);
  if (input.mask != nullptr) DropMasked(*input.mask, &inferred.map);
  const bool is_bounded = input.nearest > 0 || std::isfinite(input.farthest);
  if (is_bounded) DropInferredOutside(input.nearest, input.farthest, &inferred.map);
  return inferred;
}

}  // namespace phi

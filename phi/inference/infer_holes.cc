#include "phi/inference/infer_holes.h"

#include <memory>
#include <utility>

#include "phi/base/image_mask.h"
#include "phi/base/whole_array.h"
#include "phi/filtering/few_witnesses.h"

namespace phi {

InferenceResult InferHoles(Backend& backend, InferenceInput input, const Mask& few_witnesses, const StereoOptions& stereo,
                           const InferenceOptions& options) {
  const std::shared_ptr<const PlaneMap> measured = input.measured;
  const bool has_few = CountIf(few_witnesses, [](std::uint8_t v) { return v != 0; }) > 0;
  if (has_few) {
    auto evidence = std::make_shared<PlaneMap>(*measured);
    HideFewWitnesses(few_witnesses, evidence.get());
    input.measured = std::move(evidence);
  }
  InferenceResult inferred = backend.Infer(input, stereo, options);
  if (has_few) RestoreFewWitnesses(*measured, few_witnesses, &inferred);
  if (input.mask != nullptr) {
    DropMasked(*input.mask, &inferred.map);
    DropMasked(*input.mask, &inferred.filled);
  }
  return inferred;
}

}  // namespace phi

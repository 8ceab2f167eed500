#include "phi/filtering/few_witnesses.h"

#include <cstddef>

#include "phi/base/whole_array.h"
#include "phi/filtering/filled_value.h"

namespace phi {
namespace {

// function(i) for the pixels of the mask.
template <typename Function>
void ForMasked(const Mask& mask, const Function& function) {
  ForParts(mask.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (mask.data()[i] != 0) function(i);
    }
  });
}

}  // namespace

void HideFewWitnesses(const Mask& few_witnesses, PlaneMap* map) {
  ForMasked(few_witnesses, [&](std::size_t i) { map->data()[i] = {}; });
}

void HideFewWitnesses(const Mask& few_witnesses, DepthMap* depths) {
  ForMasked(few_witnesses, [&](std::size_t i) { depths->data()[i] = 0; });
}

void RestoreFewWitnesses(const PlaneMap& measured, const Mask& few_witnesses, InferenceResult* inferred) {
  ForMasked(few_witnesses, [&](std::size_t i) {
    inferred->map.data()[i] = measured.data()[i];
    inferred->filled.data()[i] = kMeasuredPixel;
  });
}

}  // namespace phi

#include "phi/filtering/judge_measurements.h"

#include <cstddef>

#include "phi/base/whole_array.h"
#include "phi/filtering/neighbor_agreement.h"
#include "phi/filtering/own_texture.h"

namespace phi {

void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision, FilterResult* filtered) {
  DropPlainPixels(image, noise, &filtered->map);
  JudgeByNeighbors(precision, &filtered->map);
  ForParts(filtered->map.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PlaneHypothesis& h = filtered->map.data()[i];
      if (filtered->few_witnesses.data()[i] != 0 && IsDoubtful(h.depth)) h = {};
      if (!(h.depth > 0)) filtered->few_witnesses.data()[i] = 0;
    }
  });
}

std::shared_ptr<const PlaneMap> WithoutDoubtful(std::shared_ptr<const PlaneMap> map) {
  const auto is_doubtful = [](const PlaneHypothesis& h) { return IsDoubtful(h.depth); };
  if (CountIf(*map, is_doubtful) == 0) return map;
  auto certain = std::make_shared<PlaneMap>(*map);
  ForParts(certain->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (is_doubtful(certain->data()[i])) certain->data()[i] = {};
    }
  });
  return certain;
}

}  // namespace phi

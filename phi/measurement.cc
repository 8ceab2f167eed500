#include "phi/measurement.h"

#include <utility>

#include "phi/base/image_mask.h"
#include "phi/base/whole_array.h"

namespace phi {
namespace {

PixelState StateOfMeasured(float depth) { return depth > 0 ? PixelState::kMeasured : PixelState::kNone; }

}  // namespace

MeasurementMap AllMeasured(PlaneMap planes) {
  MeasurementMap map{std::move(planes), {}};
  map.states = Transformed(map.planes, [](const PlaneHypothesis& h) { return StateOfMeasured(h.depth); });
  return map;
}

MeasuredDepths AllMeasured(DepthMap depths) {
  MeasuredDepths measured{std::move(depths), {}};
  measured.states = Transformed(measured.depths, [](float depth) { return StateOfMeasured(depth); });
  return measured;
}

MeasuredDepths DepthsOf(const MeasurementMap& map) {
  return {DepthsOf(map.planes), Transformed(map.states, [](PixelState s) { return s; })};
}

PlaneMap PublishedPlanes(const MeasurementMap& map) {
  auto planes = PlaneMap::Uninitialized(map.width(), map.height());
  ForParts(map.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const bool is_clue = map.states.data()[i] == PixelState::kClue;
      planes.data()[i] = is_clue ? PlaneHypothesis() : map.planes.data()[i];
    }
  });
  return planes;
}

std::int64_t CountPublished(const MeasurementMap& map) {
  if (map.states.empty()) return CountIf(map.planes, [](const PlaneHypothesis& h) { return h.depth > 0; });
  return CountIf(map.states, [](PixelState s) { return IsPublished(s); });
}

void DropMasked(const ImageMask& mask, MeasurementMap* map) {
  DropMasked(mask, &map->planes);
  if (!map->states.empty()) DropMasked(mask, &map->states);
}

void DropMasked(const ImageMask& mask, MeasuredDepths* depths) {
  DropMasked(mask, &depths->depths);
  if (!depths->states.empty()) DropMasked(mask, &depths->states);
}

}  // namespace phi

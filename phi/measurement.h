// What is known of an image's pixels: planes, and how each came to be known. Stages hand these to each other; what a pixel
// may be used for follows from its state alone, never from its depth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "phi/base/hd.h"
#include "phi/base/images.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi {

enum class PixelState : std::uint8_t {
  kNone = 0,           // no depth
  kMeasured,           // confirmed, and judged a measurement: published, and evidence for other pixels
  kClue,               // probably right, but plain or unconfirmed: a clue to where a plane is, and not published
  kInferredAlone,      // given by a plane hypothesis; no view measured the same
  kInferredConfirmed,  // given by a plane hypothesis, and some view confirms it
};

// Has the depth that the photos showed, and tells of other pixels: free space, confirmation of what is inferred.
PHI_HD bool IsMeasured(PixelState s) { return s == PixelState::kMeasured; }
PHI_HD bool IsInferred(PixelState s) { return s == PixelState::kInferredAlone || s == PixelState::kInferredConfirmed; }
// Has a depth in the finished map.
PHI_HD bool IsPublished(PixelState s) { return IsMeasured(s) || IsInferred(s); }
// Lines and planes of hypotheses may rest on it.
PHI_HD bool CarriesPlanes(PixelState s) { return s == PixelState::kMeasured || s == PixelState::kClue; }

using StateMap = Array2D<PixelState>;

// How many source views say what of a pixel, of those that can see it; see phi/filtering/consistency.h.
struct Testimonies {
  std::uint8_t num_confirming = 0;     // theirs is the same surface
  std::uint8_t num_close = 0;          // of these, closely
  std::uint8_t num_contradicting = 0;  // theirs is another surface, or none
  std::uint8_t num_empty = 0;          // of these, none
};

// An image's pixels. Depths are > 0 where the state is not kNone; where it is, nothing else counts. What else is to be known
// of a pixel, such as its precision, is one more map here, of the same size.
struct MeasurementMap {
  PlaneMap planes;
  StateMap states;  // empty: an estimate that nothing has judged yet

  int width() const { return planes.width(); }
  int height() const { return planes.height(); }
  std::size_t size() const { return planes.size(); }
  std::size_t bytes() const { return planes.bytes() + states.bytes(); }

  // Takes away what pixel i holds.
  void Drop(std::size_t i) {
    planes.data()[i] = {};
    states.data()[i] = PixelState::kNone;
  }
};

// On the host or a device; no data: unknown.
struct MeasuredDepthsView {
  ArrayView2D<const float> depths;
  ArrayView2D<const PixelState> states;

  PHI_HD bool IsKnown() const { return depths.data != nullptr; }
  // The depth that tells of other pixels, camera z; 0: none.
  PHI_HD float Evidence(int x, int y) const { return IsMeasured(states(x, y)) ? depths(x, y) : 0.0f; }
};

// A source view's pixels as inference reads them: a third of the bytes.
struct MeasuredDepths {
  DepthMap depths;
  StateMap states;

  int width() const { return depths.width(); }
  int height() const { return depths.height(); }
  std::size_t bytes() const { return depths.bytes() + states.bytes(); }
  MeasuredDepthsView view() const { return {depths.view(), states.view()}; }
};

// Maps of which nothing else is known: all that has depth is measured. Depths <= 0 are none.
MeasurementMap AllMeasured(PlaneMap planes);
MeasuredDepths AllMeasured(DepthMap depths);

MeasuredDepths DepthsOf(const MeasurementMap& map);

// The planes of the finished map: without clues.
PlaneMap PublishedPlanes(const MeasurementMap& map);
std::int64_t CountPublished(const MeasurementMap& map);

// Takes away what masked pixels hold; see phi/base/image_mask.h.
void DropMasked(const ImageMask& mask, MeasurementMap* map);
void DropMasked(const ImageMask& mask, MeasuredDepths* depths);

// The planes alone, which share the map's life.
inline std::shared_ptr<const PlaneMap> PlanesOf(const std::shared_ptr<const MeasurementMap>& map) {
  return {map, &map->planes};
}

}  // namespace phi

// A device that decides an image's pixels in the host's place, by support_pixel.h's rule and to the same bit: a host may go on
// wherever a device cannot.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "phi/fusion/support_pixel.h"

namespace phi {

struct DecidedPixels {
  std::vector<PixelOutcome> outcomes;  // of the pixels asked for, in their order
  std::vector<FusedPixel> fused;       // those of outcome kFused, in their order
};

class FusionDevice {
 public:
  // The image that is being fused. Safe to call concurrently.
  class Image {
   public:
    virtual ~Image() = default;
    // `pixels`: their numbers in the map. Those that are fused count as emitted from now on in the device's map; the host's is
    // the caller's. Throws phi::ResourceError where the device fails: Start of other images then returns null.
    virtual DecidedPixels Decide(const FusionGates& gates, const std::vector<std::uint32_t>& pixels) = 0;
  };

  virtual ~FusionDevice() = default;

  // A copy of the map ahead of its use, where there is room. Safe to call concurrently for different maps, also with Decide, and
  // with Start of an image that does not use the map.
  virtual void Load(ArrayView2D<const FusionPixel> map) = 0;
  // The host changed the map other than Decide did, or gives its memory up.
  virtual void Forget(ArrayView2D<const FusionPixel> map) = 0;

  // The maps are the host's, which must stay until the image is gone. `rays`: of the reference. Null where the maps do not fit into the
  // device's memory, or the device has failed. One image at a time.
  virtual std::unique_ptr<Image> Start(ArrayView2D<const FusionPixel> reference, const RayModel& rays,
                                       const std::vector<FusionNeighbor>& neighbors) = 0;
};

}  // namespace phi

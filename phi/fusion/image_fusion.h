// Fuses one image with its neighbours: which of its pixels give a point of the cloud, and which point.
//
// Images are decided in a fixed order that depends on the scene alone. A pixel gives a point when enough images
// agree on it, unless a pixel of an earlier image that gave one saw the same spot at a similar or finer
// resolution. So every patch of surface has a point, about as densely as its finest image samples it: a pixel is
// left out only for a point that is there, never for one that was left out itself, which would tear holes.
// Then the holes that are left are filled on weaker evidence. In either step all pixels of an image are independent, so
// that neither threads nor blocks of rows can change the result.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/fusion/fused_block.h"
#include "phi/fusion/fusion_options.h"
#include "phi/fusion/support_run.h"
#include "phi/geometry/camera.h"

namespace phi {

class ImageFuser {
 public:
  struct Image {
    std::uint32_t index = 0;   // of the image in the model, as in .vis files
    Camera camera;             // at the map's size
    FusionMap* map = nullptr;  // of the reference: receives the emitted flags
    bool earlier = false;      // of a neighbour: decided before the reference
  };

  // `box` may be null. The maps must outlive the fuser.
  ImageFuser(const Image& reference, const std::vector<Image>& neighbors, const FusionOptions& options,
             const BoundingBox* box);

  // Rows [begin, end). Safe to call concurrently for disjoint ranges.
  FusedBlock FuseRows(int begin, int end);

  // Points in the holes that are left in rows [begin, end) once FuseRows has done all rows; see cloud_holes.h. Safe to
  // call concurrently for disjoint ranges. The outcomes are changes to those that FuseRows returned.
  FusedBlock FillHoles(int begin, int end);

 private:
  // The support rule for up to kRunLength pixels of row y, from x on.
  void FuseRun(int x, int y, SupportRun* run, FusedBlock* block);
  // The same for the pixels `holes`, with the gates of holes.
  void FillRun(int x, int y, RunBits holes, SupportRun* run, FusedBlock* block);
  ReferenceRun MakeRun(int x, int y, RunBits wanted) const;
  PixelOutcome FusePixel(const FusionGates& gates, const ReferenceRun& reference, const SupportRun& run,
                         int i, FusedBlock* block) const;

  Image reference_;
  RayModel rays_;
  std::vector<FusionNeighbor> neighbors_;  // earlier ones first: they may end a pixel's work
  FusionGates gates_;
  FusionGates hole_gates_;  // normals that differ by more
  int hole_edge_;           // pixels, see FindHoles
  const BoundingBox* box_;
  Array2D<PixelOutcome> outcomes_;  // of the reference's pixels, as FuseRows left them
};

}  // namespace phi

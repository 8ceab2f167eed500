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

#include "phi/fusion/fusion_options.h"
#include "phi/fusion/pixel_outcome.h"
#include "phi/fusion/support_run.h"
#include "phi/geometry/camera.h"

namespace phi {

struct FusedPoint {
  double xyz[3] = {0, 0, 0};    // world
  float normal[3] = {0, 0, 0};  // world, unit
  std::uint8_t rgb[3] = {0, 0, 0};
  std::uint8_t inferred = 0;  // 1: more of its measurements were inferred than measured
};

// Points in pixel order. The views of point k are the next view_counts[k] entries of views, ascending.
struct FusedBlock {
  std::vector<FusedPoint> points;
  std::vector<std::uint32_t> view_counts;
  std::vector<std::uint32_t> views;
  OutcomeCounts outcomes;
};

// World units; points outside are dropped.
struct BoundingBox {
  double min[3], max[3];
};

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
  // A point about to be written: position and normal in the reference frame, normal of any length.
  struct Candidate {
    Vec3f point, normal;
    int rgb_sum[3] = {0, 0, 0};
    int num_views = 0, num_inferred = 0;
  };

  // The support rule for up to kRunLength pixels of row y, from x on.
  void FuseRun(int x, int y, SupportRun* run, FusedBlock* block);
  // The same for the pixels `holes`, with the gates of holes.
  void FillRun(int x, int y, RunBits holes, SupportRun* run, FusedBlock* block);
  ReferenceRun MakeRun(int x, int y, RunBits wanted) const;
  PixelOutcome FusePixel(const FusionGates& gates, const ReferenceRun& reference, const SupportRun& run,
                         int i, FusedBlock* block) const;
  void FuseRowAsPaper(int y, FusedBlock* block);
  PixelOutcome FuseAsPaper(const FusionPixel& pixel, Vec3f ray, FusedBlock* block) const;
  bool Covers(const FusionNeighbor& neighbor, const FusionPixel& theirs, const FusionPixel& pixel,
              Vec3f ray) const;
  void Merge(std::uint32_t image, const FusionPixel& pixel, Candidate* candidate, FusedBlock* block) const;
  PixelOutcome Emit(const Candidate& candidate, FusedBlock* block) const;

  Image reference_;
  RayModel rays_;
  std::vector<FusionNeighbor> neighbors_;  // earlier ones first: they may end a pixel's work
  FusionRule rule_;
  FusionGates gates_;
  FusionGates hole_gates_;  // normals that differ by more
  const BoundingBox* box_;
  Array2D<PixelOutcome> outcomes_;  // of the reference's pixels, as FuseRows left them
};

}  // namespace phi

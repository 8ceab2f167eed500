// Fuses one image with its neighbours: which of its pixels give a point of the cloud, and which point.
//
// Images are decided in a fixed order that depends on the scene alone. A pixel gives a point when enough images
// agree on it, unless a pixel of an earlier image that gave one saw the same spot at a similar or finer
// resolution. So every patch of surface has a point, about as densely as its finest image samples it: a pixel is
// left out only for a point that is there, never for one that was left out itself, which would tear holes.
// Then the holes that are left are filled on weaker evidence. In either step all pixels of an image are independent, so
// that neither threads nor blocks of rows can change the result.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "phi/fusion/fused_block.h"
#include "phi/fusion/fusion_device.h"
#include "phi/fusion/fusion_options.h"
#include "phi/fusion/point_confidence.h"
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
    bool stands_apart = true;  // of a neighbour, see FusionNeighbor
  };

  // `box` and `device` may be null. The maps must outlive the fuser. With a device, its copy of the reference's map is right when
  // all rows and holes are done.
  ImageFuser(const Image& reference, const std::vector<Image>& neighbors, const FusionOptions& options,
             const BoundingBox* box, FusionDevice* device = nullptr);
  ~ImageFuser();

  // Rows [begin, end). Safe to call concurrently for disjoint ranges.
  FusedBlock FuseRows(int begin, int end);

  // Points in the holes that are left in rows [begin, end) once FuseRows has done all rows; see cloud_holes.h. Safe to
  // call concurrently for disjoint ranges. The outcomes are changes to those that FuseRows returned.
  FusedBlock FillHoles(int begin, int end);

  // Of each pixel in rows [begin, end) with a depth, how probably that is right (point_confidence.h): the confidence of the point that
  // the pixel gave, or would give if no earlier image covered it, into `confidence`, of the map's size and elsewhere left as it is.
  // By the host alone. Once all rows and holes are done. Safe to call concurrently for disjoint ranges.
  void RateRows(int begin, int end, Array2D<float>* confidence) const;

 private:
  // First all pixels of the image are asked, then those in holes, by other gates.
  enum class Pass { kAll, kHoles };

  // The support rule for these pixels, by their numbers in the map, ascending.
  FusedBlock Fuse(Pass pass, const std::vector<std::uint32_t>& pixels);
  // False: it failed, and did nothing.
  bool FuseOnDevice(Pass pass, const std::vector<std::uint32_t>& pixels, FusedBlock* block);
  void FuseOnHost(Pass pass, const std::vector<std::uint32_t>& pixels, FusedBlock* block);
  // The pixels `wanted` of up to kRunLength of row y, from x on.
  // Those that give a point are added to `fused`; their outcomes are Emit's to note.
  void FuseRun(Pass pass, int x, int y, RunBits wanted, SupportRun* run, std::vector<FusedPixel>* fused, FusedBlock* block);
  ReferenceRun MakeRun(int x, int y, RunBits wanted) const;
  void RateRun(Pass pass, int x, int y, RunBits wanted, SupportRun* run, Array2D<float>* confidence) const;
  // The pixels of a run from (x, y) on that have a depth, and of whose points this pass decides.
  RunBits PixelsOf(Pass pass, int x, int y) const;
  const FusionGates& GatesOf(Pass pass) const { return pass == Pass::kHoles ? hole_gates_ : gates_; }
  void Emit(Pass pass, std::span<const FusedPixel> pixels, FusedBlock* block);
  // The point of pixel (x, y).
  PixelOutcome EmitPixel(int x, int y, const FusedPixel& pixel, float confidence, FusedBlock* block) const;
  void Note(Pass pass, int x, int y, PixelOutcome outcome, FusedBlock* block);
  std::vector<std::uint32_t> HolesIn(int begin, int end) const;

  Image reference_;
  RayModel rays_;
  std::vector<FusionNeighbor> neighbors_;  // earlier ones first: they may end a pixel's work
  FusionGates gates_;
  FusionGates hole_gates_;  // normals that differ by more
  int hole_edge_;           // pixels, see FindHoles
  float min_confidence_;
  bool keeps_terms_;
  const BoundingBox* box_;
  FusionDevice* device_;
  std::unique_ptr<FusionDevice::Image> on_device_;  // null: the host decides
  std::atomic<bool> is_device_right_ = true;        // its copy of the reference's map
  Array2D<PixelOutcome> outcomes_;  // of the reference's pixels, as FuseRows left them
};

}  // namespace phi

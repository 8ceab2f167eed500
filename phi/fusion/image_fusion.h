// Fuses one image with its neighbours: which of its pixels give a point of the cloud, and which point.
//
// Images are decided in a fixed order that depends on the scene alone. A pixel gives a point when enough images
// agree on it, unless a pixel of an earlier image that gave one saw the same spot at a similar or finer
// resolution. So every patch of surface has a point, about as densely as its finest image samples it: a pixel is
// left out only for a point that is there, never for one that was left out itself, which would tear holes.
// Within an image all pixels are independent, so that neither threads nor blocks of rows can change the result.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "phi/fusion/fusion_options.h"
#include "phi/fusion/support_run.h"
#include "phi/geometry/camera.h"

namespace phi {

// What became of a pixel.
enum class PixelOutcome : std::uint8_t {
  kFused,    // gave a point
  kCovered,  // an earlier image's point covers it
  kNoDepth,
  kTooFewViews,   // too few images see the spot and have depth there
  kDepth,         // too few agree on depth
  kReprojection,  // too few of those agree within the reprojection error
  kNormal,        // too few of those agree on the normal
  kSeenThrough,   // images see through the point to something behind it
  kWeakSupport,   // enough images agree, but only just
  kOutsideBox,
};
inline constexpr int kNumPixelOutcomes = 10;

class OutcomeCounts {
 public:
  std::int64_t& operator[](PixelOutcome outcome) { return counts_[static_cast<std::size_t>(outcome)]; }
  std::int64_t operator[](PixelOutcome outcome) const { return counts_[static_cast<std::size_t>(outcome)]; }
  OutcomeCounts& operator+=(const OutcomeCounts& other);

 private:
  std::array<std::int64_t, kNumPixelOutcomes> counts_{};
};

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
  FusedBlock FuseRows(int begin, int end) const;

 private:
  // A point about to be written: position and normal in the reference frame, normal of any length.
  struct Candidate {
    Vec3f point, normal;
    int rgb_sum[3] = {0, 0, 0};
    int num_views = 0, num_inferred = 0;
  };

  // The support rule for up to kRunLength pixels of row y, from x on.
  void FuseRun(int x, int y, SupportRun* run, FusedBlock* block) const;
  ReferenceRun MakeRun(int x, int y, int count) const;
  PixelOutcome FusePixel(const ReferenceRun& reference, const SupportRun& run, int i,
                         FusedBlock* block) const;
  void FuseRowAsPaper(int y, FusedBlock* block) const;
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
  const BoundingBox* box_;
};

}  // namespace phi

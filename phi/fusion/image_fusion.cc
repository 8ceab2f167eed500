#include "phi/fusion/image_fusion.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "phi/base/error.h"
#include "phi/fusion/cloud_holes.h"

namespace phi {
namespace {

float CosineOfDegrees(double angle) { return static_cast<float>(std::cos(angle * M_PI / 180)); }

void ApplyRules(const Rules& rules, FusionGates* gates) {
  gates->min_ray_cosine *= rules.Scale(Rule::kRayAgreement);
  gates->hopeless_factor *= rules.Scale(Rule::kRayAgreement);
  gates->seen_through_factor *= rules.Scale(Rule::kConflicts);
  if (!rules.IsOn(Rule::kConflicts)) gates->max_conflicts = std::numeric_limits<float>::infinity();
  gates->cover_factor *= rules.Scale(Rule::kCover);
  gates->max_coarsening *= rules.Scale(Rule::kCover);
  gates->min_slant_cosine *= rules.Scale(Rule::kCover);
}

FusionGates MakeGates(const FusionOptions& options) {
  FusionGates gates;
  gates.max_reproj_error = static_cast<float>(options.max_reproj_error);
  gates.max_depth_error = static_cast<float>(options.max_depth_error);
  gates.min_normal_cosine = CosineOfDegrees(options.max_normal_error);
  gates.min_support = static_cast<float>(options.min_support);
  gates.min_support_inferred =
      static_cast<float>(std::max(options.min_support, options.min_support_inferred));
  gates.max_conflicts = static_cast<float>(options.max_conflicts);
  gates.min_num_views = options.min_num_views;
  gates.max_num_views = options.max_num_views;
  ApplyRules(options.rules, &gates);
  return gates;
}

// The test without which enough images would have agreed with pixel i of the run, or the nearest to it.
PixelOutcome Diagnose(const SupportRun& run, int i, int min_num_views) {
  int num_views = run.num_agreeing[i] + run.num_normal[i];
  if (num_views >= min_num_views) return PixelOutcome::kNormal;
  num_views += run.num_reprojection[i];
  if (num_views >= min_num_views) return PixelOutcome::kReprojection;
  num_views += run.num_depth[i];
  return num_views >= min_num_views ? PixelOutcome::kDepth : PixelOutcome::kTooFewViews;
}

bool HasPixel(RunBits bits, int i) { return (bits >> i & 1u) != 0; }

}  // namespace

ImageFuser::ImageFuser(const Image& reference, const std::vector<Image>& neighbors,
                       const FusionOptions& options, const BoundingBox* box)
    : reference_(reference),
      rays_(MakeRayModel(reference.camera.pinhole)),
      gates_(MakeGates(options)),
      hole_gates_(gates_),
      hole_edge_(options.rules.Count(Rule::kCloudHoles, kMaxEdgeOfHole)),
      box_(box),
      outcomes_(reference.map->width(), reference.map->height(), PixelOutcome::kNoDepth) {
  // With the same gates no hole is looked for.
  if (options.rules.IsOn(Rule::kCloudHoles)) {
    hole_gates_.min_normal_cosine =
        std::min(gates_.min_normal_cosine, CosineOfDegrees(options.max_normal_error_in_holes));
  }
  if (neighbors.size() > kMaxFusionNeighbors) {
    throw UsageError("fusion: an image has " + std::to_string(neighbors.size()) + " neighbours, at most " +
                     std::to_string(kMaxFusionNeighbors) +
                     " are possible; lower --StereoFusion.check_num_images");
  }
  for (const bool earlier : {true, false}) {
    for (const Image& image : neighbors) {
      if (image.earlier != earlier) continue;
      const Pinhole& k = image.camera.pinhole;
      if (image.map->size() > kMaxFusionPixels) {
        throw ResourceError("fusion: a depth map of " + std::to_string(k.width) + "x" +
                            std::to_string(k.height) + " is too large; lower --StereoFusion.max_image_size");
      }
      neighbors_.push_back({image.index, earlier && options.rules.IsOn(Rule::kCover),
                            MakeRelativeView(reference.camera, image.camera), static_cast<float>(1 / k.fx),
                            static_cast<float>(1 / k.fy), static_cast<const FusionMap*>(image.map)->view()});
    }
  }
}

FusedBlock ImageFuser::FuseRows(int begin, int end) {
  FusedBlock block;
  SupportRun run(neighbors_);
  for (int y = begin; y < end; ++y) {
    for (int x = 0; x < reference_.map->width(); x += kRunLength) FuseRun(x, y, &run, &block);
  }
  return block;
}

FusedBlock ImageFuser::FillHoles(int begin, int end) {
  FusedBlock block;
  if (hole_gates_.min_normal_cosine == gates_.min_normal_cosine) return block;
  SupportRun run(neighbors_);
  for (int y = begin; y < end; ++y) {
    const std::vector<char> row = FindHoles(outcomes_, y, hole_edge_);
    for (int x = 0; x < outcomes_.width(); x += kRunLength) {
      RunBits holes = 0;
      for (int i = 0; i < std::min(kRunLength, outcomes_.width() - x); ++i)
        holes |= static_cast<RunBits>(row[static_cast<std::size_t>(x + i)]) << i;
      if (holes != 0) FillRun(x, y, holes, &run, &block);
    }
  }
  return block;
}

void ImageFuser::FillRun(int x, int y, RunBits holes, SupportRun* run, FusedBlock* block) {
  const ReferenceRun reference = MakeRun(x, y, holes);
  DecideRun(neighbors_, hole_gates_, reference, run);
  for (int i = 0; i < kRunLength; ++i) {
    if (!HasPixel(run->has_depth & ~run->covered, i)) continue;
    if (FusePixel(hole_gates_, reference, *run, i, block) != PixelOutcome::kFused) continue;
    (*reference_.map)(x + i, y).flags |= FusionPixel::kEmitted;
    --block->outcomes[outcomes_(x + i, y)];
    ++block->outcomes[PixelOutcome::kFused];
  }
}

ReferenceRun ImageFuser::MakeRun(int x, int y, RunBits wanted) const {
  ReferenceRun reference;
  reference.fx = rays_.fx;
  reference.ray_y = rays_.Ray(0, y + 0.5f).y;
  const FusionPixel* pixels = &(*reference_.map)(x, y);
  for (int i = 0; i < kRunLength; ++i) {
    const FusionPixel pixel = HasPixel(wanted, i) ? pixels[i] : FusionPixel();
    std::uint32_t words[FusionPixel::kNumWords];
    std::memcpy(words, &pixel, sizeof(words));
    reference.depth[i] = pixel.depth;
    reference.normal[i] = words[FusionPixel::kNormalWord];
    reference.ray_x[i] = rays_.Ray(x + i + 0.5f, 0).x;
    reference.color[i] = words[FusionPixel::kColorWord];
  }
  return reference;
}

void ImageFuser::FuseRun(int x, int y, SupportRun* run, FusedBlock* block) {
  const int count = std::min(kRunLength, reference_.map->width() - x);
  const ReferenceRun reference = MakeRun(x, y, (RunBits{1} << count) - 1);
  DecideRun(neighbors_, gates_, reference, run);
  for (int i = 0; i < count; ++i) {
    PixelOutcome outcome = PixelOutcome::kNoDepth;
    if (HasPixel(run->covered, i)) {
      outcome = PixelOutcome::kCovered;
    } else if (HasPixel(run->has_depth, i)) {
      outcome = FusePixel(gates_, reference, *run, i, block);
    }
    if (outcome == PixelOutcome::kFused) (*reference_.map)(x + i, y).flags |= FusionPixel::kEmitted;
    outcomes_(x + i, y) = outcome;
    ++block->outcomes[outcome];
  }
}

PixelOutcome ImageFuser::FusePixel(const FusionGates& gates, const ReferenceRun& reference,
                                   const SupportRun& run, int i, FusedBlock* block) const {
  if (run.num_agreeing[i] < gates.min_num_views) return Diagnose(run, i, gates.min_num_views);
  const int num_views = run.num_views[i];
  if (num_views < gates.min_num_views || !HasPixel(run.reference.agrees, i)) return PixelOutcome::kDepth;
  const bool inferred = (reference.color[i] >> 24 & FusionPixel::kInferred) != 0;
  const float min_support = inferred ? gates.min_support_inferred : gates.min_support;
  if (gates.min_num_views > 1 && run.support[i] < min_support) return PixelOutcome::kWeakSupport;
  const float num_conflicts = static_cast<float>(run.num_seen_through[i]);
  if (num_conflicts > gates.max_conflicts * std::max(1, num_views - 1)) return PixelOutcome::kSeenThrough;

  PointCandidate candidate;
  const Vec3f ray = {reference.ray_x[i], reference.ray_y, 1.0f};
  candidate.point = reference.depth[i] * (1 + run.relative_depth[i]) * ray;
  candidate.normal = {run.normal_sum[0][i], run.normal_sum[1][i], run.normal_sum[2][i]};
  for (int c = 0; c < 3; ++c) candidate.rgb_sum[c] = run.rgb_sum[c][i];
  candidate.num_views = num_views;
  candidate.num_inferred = run.num_inferred[i];
  block->views.push_back(reference_.index);
  for (const std::uint32_t k : run.agreeing) {
    if (HasPixel(run.answers[k].agrees, i)) block->views.push_back(neighbors_[k].image);
  }
  return EmitPoint(reference_.camera.pose, box_, candidate, block);
}

}  // namespace phi

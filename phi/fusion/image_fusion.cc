#include "phi/fusion/image_fusion.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "phi/base/error.h"
#include "phi/fusion/paper_rule.h"

namespace phi {
namespace {

// A pixel is covered only by one that samples the surface at most so much more coarsely.
constexpr float kMaxCoarsening = 1.5f;

FusionGates MakeGates(const FusionOptions& options) {
  FusionGates gates;
  gates.max_reproj_error = static_cast<float>(options.max_reproj_error);
  gates.max_depth_error = static_cast<float>(options.max_depth_error);
  gates.min_normal_cosine = static_cast<float>(std::cos(options.max_normal_error * M_PI / 180));
  gates.min_support = static_cast<float>(options.min_support);
  gates.max_conflicts = static_cast<float>(options.max_conflicts);
  gates.min_num_views = options.min_num_views;
  gates.max_num_views = options.max_num_views;
  return gates;
}

using AnswerCounts = std::array<int, kNumAgreements>;

// The test without which enough images would have agreed, or the nearest to it.
PixelOutcome Diagnose(const AnswerCounts& answers, int num_views, int min_num_views) {
  const auto count = [&](Agreement a) { return answers[static_cast<std::size_t>(a)]; };
  num_views += count(Agreement::kNormal);
  if (num_views >= min_num_views) return PixelOutcome::kNormal;
  num_views += count(Agreement::kReprojection);
  if (num_views >= min_num_views) return PixelOutcome::kReprojection;
  num_views += count(Agreement::kDepth) + count(Agreement::kSeenThrough) + count(Agreement::kBehind);
  return num_views >= min_num_views ? PixelOutcome::kDepth : PixelOutcome::kTooFewViews;
}

}  // namespace

OutcomeCounts& OutcomeCounts::operator+=(const OutcomeCounts& other) {
  for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
  return *this;
}

ImageFuser::ImageFuser(const Image& reference, const std::vector<Image>& neighbors,
                       const FusionOptions& options, const BoundingBox* box)
    : reference_(reference),
      rays_(MakeRayModel(reference.camera.pinhole)),
      rule_(options.rule),
      gates_(MakeGates(options)),
      box_(box) {
  if (neighbors.size() > kMaxFusionNeighbors) {
    throw UsageError("fusion: an image has " + std::to_string(neighbors.size()) + " neighbours, at most " +
                     std::to_string(kMaxFusionNeighbors) +
                     " are possible; lower --StereoFusion.check_num_images");
  }
  for (const bool earlier : {true, false}) {
    for (const Image& image : neighbors) {
      if (image.earlier != earlier) continue;
      const Pinhole& k = image.camera.pinhole;
      neighbors_.push_back({image.index, earlier, MakeRelativeView(reference.camera, image.camera),
                            static_cast<float>(1 / k.fx), static_cast<float>(1 / k.fy),
                            static_cast<const FusionMap*>(image.map)->view()});
    }
  }
}

FusedBlock ImageFuser::FuseRows(int begin, int end) const {
  FusedBlock block;
  std::size_t hint = 0;
  for (int y = begin; y < end; ++y) {
    for (int x = 0; x < reference_.map->width(); ++x) {
      FusionPixel& pixel = (*reference_.map)(x, y);
      PixelOutcome outcome = PixelOutcome::kNoDepth;
      if (pixel.depth > 0) {
        const Vec3f ray = rays_.Ray(x + 0.5f, y + 0.5f);
        outcome = rule_ == FusionRule::kPaper ? FuseAsPaper(pixel, ray, &block)
                                              : FuseBySupport(pixel, ray, &hint, &block);
      }
      if (outcome == PixelOutcome::kFused) pixel.flags |= FusionPixel::kEmitted;
      ++block.outcomes[outcome];
    }
  }
  return block;
}

bool ImageFuser::Covers(const FusionNeighbor& neighbor, const FusionPixel& theirs, float depth) const {
  // Footprints are depth / focal length, on either side.
  return neighbor.earlier && (theirs.flags & FusionPixel::kEmitted) != 0 &&
         theirs.depth * rays_.fx <= kMaxCoarsening * depth * neighbor.view.source.fx;
}

PixelOutcome ImageFuser::FuseBySupport(const FusionPixel& pixel, Vec3f ray, std::size_t* hint,
                                       FusedBlock* block) const {
  const Vec3f normal = UnpackNormal(pixel.normal);
  const auto is_covered_by = [&](std::size_t k, const NeighborAnswer& answer) {
    return answer.covers && Covers(neighbors_[k], *answer.pixel, pixel.depth);
  };
  if (*hint < neighbors_.size() && neighbors_[*hint].earlier &&
      is_covered_by(*hint, AskNeighbor(neighbors_[*hint], ray, pixel.depth, normal, gates_))) {
    return PixelOutcome::kCovered;
  }
  Measurement measurements[kMaxFusionNeighbors + 1];
  measurements[0] = {Measurement::kReference, 0, 1, &pixel};
  int count = 1;
  AnswerCounts answers{};
  for (std::size_t k = 0; k < neighbors_.size(); ++k) {
    const NeighborAnswer answer = AskNeighbor(neighbors_[k], ray, pixel.depth, normal, gates_);
    ++answers[static_cast<std::size_t>(answer.agreement)];
    if (is_covered_by(k, answer)) {
      *hint = k;
      return PixelOutcome::kCovered;
    }
    if (answer.agreement == Agreement::kAgrees && count < gates_.max_num_views) {
      measurements[count++] = MakeMeasurement(answer, static_cast<int>(k), gates_);
    }
  }
  if (count < gates_.min_num_views) return Diagnose(answers, count, gates_.min_num_views);
  const Consensus consensus = FindConsensus(measurements, count, gates_);
  if (consensus.num_views < gates_.min_num_views || measurements[0].neighbor == Measurement::kDropped) {
    return PixelOutcome::kDepth;
  }
  if (gates_.min_num_views > 1 && consensus.support < gates_.min_support) return PixelOutcome::kWeakSupport;
  const int conflicts = answers[static_cast<std::size_t>(Agreement::kSeenThrough)];
  if (static_cast<float>(conflicts) > gates_.max_conflicts * std::max(1, consensus.num_views - 1)) {
    return PixelOutcome::kSeenThrough;
  }

  Candidate candidate;
  candidate.point = pixel.depth * (1 + consensus.relative_depth) * ray;
  for (int i = 0; i < count; ++i) {
    const Measurement& m = measurements[i];
    if (m.neighbor == Measurement::kDropped) continue;
    candidate.normal = candidate.normal + m.agreement * NormalInReference(m.neighbor, *m.pixel);
    Merge(m.neighbor, *m.pixel, &candidate, block);
  }
  return Emit(candidate, block);
}

PixelOutcome ImageFuser::FuseAsPaper(const FusionPixel& pixel, Vec3f ray, FusedBlock* block) const {
  const Vec3f point = pixel.depth * ray;
  Candidate candidate;
  candidate.point = point;
  candidate.normal = UnpackNormal(pixel.normal);
  std::array<int, kMaxFusionNeighbors> merged;
  std::array<const FusionPixel*, kMaxFusionNeighbors> pixels;
  int count = 0, num_with_depth = 1;
  for (std::size_t k = 0; k < neighbors_.size(); ++k) {
    const PaperAnswer answer = AskNeighborAsPaper(neighbors_[k], point, gates_);
    num_with_depth += answer.pixel != nullptr && answer.pixel->depth > 0;
    if (!answer.agrees) continue;
    if (Covers(neighbors_[k], *answer.pixel, pixel.depth)) return PixelOutcome::kCovered;
    if (count + 1 >= gates_.max_num_views) continue;
    candidate.point = candidate.point + answer.point;
    candidate.normal = candidate.normal + NormalInReference(static_cast<int>(k), *answer.pixel);
    merged[static_cast<std::size_t>(count)] = static_cast<int>(k);
    pixels[static_cast<std::size_t>(count++)] = answer.pixel;
  }
  if (count + 1 < gates_.min_num_views) {
    return num_with_depth < gates_.min_num_views ? PixelOutcome::kTooFewViews : PixelOutcome::kDepth;
  }
  candidate.point = (1.0f / static_cast<float>(count + 1)) * candidate.point;
  Merge(Measurement::kReference, pixel, &candidate, block);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    Merge(merged[i], *pixels[i], &candidate, block);
  return Emit(candidate, block);
}

Vec3f ImageFuser::NormalInReference(int neighbor, const FusionPixel& pixel) const {
  const Vec3f normal = UnpackNormal(pixel.normal);
  if (neighbor == Measurement::kReference) return normal;
  return TransposedTimes(neighbors_[static_cast<std::size_t>(neighbor)].view.rotation, normal);
}

void ImageFuser::Merge(int neighbor, const FusionPixel& pixel, Candidate* candidate,
                       FusedBlock* block) const {
  for (int c = 0; c < 3; ++c) candidate->rgb_sum[c] += pixel.rgb[c];
  ++candidate->num_views;
  candidate->num_inferred += (pixel.flags & FusionPixel::kInferred) != 0;
  block->views.push_back(neighbor == Measurement::kReference
                             ? reference_.index
                             : neighbors_[static_cast<std::size_t>(neighbor)].image);
}

PixelOutcome ImageFuser::Emit(const Candidate& candidate, FusedBlock* block) const {
  const auto to_double = [](Vec3f v) { return Eigen::Vector3d(v.x, v.y, v.z); };
  const Pose& pose = reference_.camera.pose;
  const Eigen::Vector3d world = pose.rotation.transpose() * (to_double(candidate.point) - pose.translation);
  const Eigen::Vector3d normal = pose.rotation.transpose() * to_double(candidate.normal).normalized();
  const auto first_view = block->views.end() - candidate.num_views;
  FusedPoint point;
  for (int axis = 0; axis < 3; ++axis) {
    if (box_ != nullptr && !(world[axis] >= box_->min[axis] && world[axis] <= box_->max[axis])) {
      block->views.erase(first_view, block->views.end());
      return PixelOutcome::kOutsideBox;
    }
    point.xyz[axis] = world[axis];
    point.normal[axis] = static_cast<float>(normal[axis]);
    const int sum = candidate.rgb_sum[axis];
    point.rgb[axis] = static_cast<std::uint8_t>((sum + candidate.num_views / 2) / candidate.num_views);
  }
  std::sort(first_view, block->views.end());
  point.inferred = 2 * candidate.num_inferred > candidate.num_views;
  block->points.push_back(point);
  block->view_counts.push_back(static_cast<std::uint32_t>(candidate.num_views));
  return PixelOutcome::kFused;
}

}  // namespace phi

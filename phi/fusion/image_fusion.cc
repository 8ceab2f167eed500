#include "phi/fusion/image_fusion.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>

#include "phi/base/error.h"
#include "phi/base/log.h"
#include "phi/fusion/cloud_holes.h"

namespace phi {
namespace {

// Enough for the rater, few enough for the fastest memory.
constexpr std::size_t kEmittedAtOnce = 8 * PointRater::kSize;

float CosineOfDegrees(double angle) { return static_cast<float>(std::cos(angle * std::numbers::pi / 180)); }

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
  ApplyRules(options.method.rules, &gates);
  return gates;
}

bool HasPixel(RunBits bits, int i) { return (bits >> i & 1u) != 0; }

// Of pixel i of the run, which has a depth and is not covered; views apart.
PixelSupport SupportOf(const SupportRun& run, int i) {
  PixelSupport support;
  support.has_depth = true;
  support.num_without_depth = run.num_without_depth[i];
  support.num_other_depth = run.num_depth[i];
  support.num_other_reprojection = run.num_reprojection[i];
  support.num_other_normal = run.num_normal[i];
  support.num_seen_through = run.num_seen_through[i];
  support.num_hidden = run.num_hidden[i];
  support.num_agreeing = run.num_agreeing[i];
  support.reference_is_near = HasPixel(run.reference.agrees, i);
  support.support = run.support[i];
  support.point.relative_depth = run.relative_depth[i];
  support.point.num_views = run.num_views[i];
  support.point.num_inferred = run.num_inferred[i];
  support.point.brightness_squares = run.brightness_squares[i];
  support.point.least_cosine = run.least_cosine[i];
  for (int c = 0; c < 3; ++c) support.point.rgb_sum[c] = run.rgb_sum[c][i];
  support.point.normal_sum = {run.normal_sum[0][i], run.normal_sum[1][i], run.normal_sum[2][i]};
  return support;
}

// Without branches, which nothing could foretell.
void AddViews(const SupportRun& run, int i, NeighborSet* views) {
  for (const std::uint32_t k : run.agreeing) views->AddIf(run.answers[k].agrees >> i & 1u, static_cast<int>(k));
}

}  // namespace

ImageFuser::ImageFuser(const Image& reference, const std::vector<Image>& neighbors,
                       const FusionOptions& options, const BoundingBox* box, FusionDevice* device)
    : reference_(reference),
      rays_(MakeRayModel(reference.camera.pinhole)),
      gates_(MakeGates(options)),
      hole_gates_(gates_),
      hole_edge_(options.method.rules.Count(Rule::kCloudHoles, kMaxEdgeOfHole)),
      min_confidence_(static_cast<float>(options.min_confidence)),
      keeps_terms_(options.keeps_terms),
      box_(box),
      device_(device),
      outcomes_(reference.map->width(), reference.map->height(), PixelOutcome::kNoDepth) {
  // With the same gates no hole is looked for.
  if (options.method.rules.IsOn(Rule::kCloudHoles)) {
    hole_gates_.min_normal_cosine =
        std::min(gates_.min_normal_cosine, CosineOfDegrees(options.max_normal_error_in_holes));
  }
  if (neighbors.size() > kMaxFusionNeighbors) {
    throw UsageError(AboutStage("fusion") + ": an image has " + std::to_string(neighbors.size()) + " neighbours, at most " +
                     std::to_string(kMaxFusionNeighbors) +
                     " are possible; lower --StereoFusion.check_num_images");
  }
  for (const bool earlier : {true, false}) {
    for (const Image& image : neighbors) {
      if (image.earlier != earlier) continue;
      const Pinhole& k = image.camera.pinhole;
      if (image.map->size() > kMaxFusionPixels) {
        throw ResourceError(AboutStage("fusion") + ": a depth map of " + std::to_string(k.width) + "x" +
                            std::to_string(k.height) + " is too large; lower --StereoFusion.max_image_size");
      }
      neighbors_.push_back({image.index, earlier && options.method.rules.IsOn(Rule::kCover),
                            MakeRelativeView(reference.camera, image.camera), static_cast<float>(1 / k.fx),
                            static_cast<float>(1 / k.fy), static_cast<const FusionMap*>(image.map)->view(), image.stands_apart});
      const RelativeView& view = neighbors_.back().view;
      neighbors_.back().center = TransposedTimes(view.rotation, -1.0f * view.translation);
    }
  }
  if (device_ == nullptr) return;
  on_device_ = device_->Start(reference_.map->view(), rays_, neighbors_);
  is_device_right_ = on_device_ != nullptr && box_ == nullptr && min_confidence_ == 0;
}

ImageFuser::~ImageFuser() {
  on_device_.reset();
  if (device_ != nullptr && !is_device_right_) device_->Forget(reference_.map->view());
}

FusedBlock ImageFuser::FuseRows(int begin, int end) {
  const std::uint32_t width = static_cast<std::uint32_t>(outcomes_.width());
  std::vector<std::uint32_t> pixels(width * static_cast<std::uint32_t>(end - begin));
  std::iota(pixels.begin(), pixels.end(), width * static_cast<std::uint32_t>(begin));
  return Fuse(Pass::kAll, pixels);
}

FusedBlock ImageFuser::FillHoles(int begin, int end) {
  if (hole_gates_.min_normal_cosine == gates_.min_normal_cosine) return {};
  return Fuse(Pass::kHoles, HolesIn(begin, end));
}

std::vector<std::uint32_t> ImageFuser::HolesIn(int begin, int end) const {
  std::vector<std::uint32_t> holes;
  for (int y = begin; y < end; ++y) {
    const std::vector<char> row = FindHoles(outcomes_, y, hole_edge_);
    const std::uint32_t first = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(outcomes_.width());
    for (std::uint32_t x = 0; x < row.size(); ++x) {
      if (row[x] != 0) holes.push_back(first + x);
    }
  }
  return holes;
}

FusedBlock ImageFuser::Fuse(Pass pass, const std::vector<std::uint32_t>& pixels) {
  FusedBlock block;
  if (pass == Pass::kAll) {  // fewer points move than if the block grew by and by; room that is not used is not touched
    block.points.reserve(pixels.size());
    block.view_counts.reserve(pixels.size());
  }
  if (on_device_ == nullptr || !FuseOnDevice(pass, pixels, &block)) FuseOnHost(pass, pixels, &block);
  return block;
}

bool ImageFuser::FuseOnDevice(Pass pass, const std::vector<std::uint32_t>& pixels, FusedBlock* block) {
  if (pixels.empty()) return true;
  DecidedPixels decided;
  try {
    decided = on_device_->Decide(GatesOf(pass), pixels);
  } catch (const ResourceError& error) {
    if (is_device_right_.exchange(false)) LogWarning(std::string(error.what()) + "; the processor goes on in its place");
    return false;
  }
  const std::uint32_t width = static_cast<std::uint32_t>(outcomes_.width());
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    if (decided.outcomes[k] == PixelOutcome::kFused) continue;
    Note(pass, static_cast<int>(pixels[k] % width), static_cast<int>(pixels[k] / width), decided.outcomes[k], block);
  }
  Emit(pass, decided.fused, block);
  return true;
}

void ImageFuser::FuseOnHost(Pass pass, const std::vector<std::uint32_t>& pixels, FusedBlock* block) {
  SupportRun run(neighbors_);
  std::vector<FusedPixel> fused;
  const std::uint32_t width = static_cast<std::uint32_t>(outcomes_.width());
  for (std::size_t k = 0; k < pixels.size();) {
    const std::uint32_t y = pixels[k] / width, x = pixels[k] % width / kRunLength * kRunLength;
    const std::uint32_t first = y * width + x, end = first + std::min<std::uint32_t>(kRunLength, width - x);
    RunBits wanted = 0;
    for (; k < pixels.size() && pixels[k] < end; ++k) wanted |= RunBits{1} << (pixels[k] - first);
    FuseRun(pass, static_cast<int>(x), static_cast<int>(y), wanted, &run, &fused, block);
    if (fused.size() < kEmittedAtOnce) continue;
    Emit(pass, fused, block);
    fused.clear();
  }
  Emit(pass, fused, block);
}

void ImageFuser::FuseRun(Pass pass, int x, int y, RunBits wanted, SupportRun* run, std::vector<FusedPixel>* fused,
                         FusedBlock* block) {
  const FusionGates& gates = GatesOf(pass);
  const ReferenceRun reference = MakeRun(x, y, wanted);
  DecideRun(neighbors_, gates, reference, run);
  for (int i = 0; i < kRunLength; ++i) {
    if (!HasPixel(wanted, i)) continue;
    if (!HasPixel(run->has_depth & ~run->covered, i)) {
      Note(pass, x + i, y, HasPixel(run->covered, i) ? PixelOutcome::kCovered : PixelOutcome::kNoDepth, block);
      continue;
    }
    const PixelSupport support = SupportOf(*run, i);
    const bool is_inferred = (reference.color[i] >> 24 & FusionPixel::kInferred) != 0;
    const PixelOutcome outcome = JudgePixel(gates, support, is_inferred);
    if (outcome == PixelOutcome::kFused) {
      FusedPixel& pixel = fused->emplace_back();
      pixel.pixel = static_cast<std::uint32_t>(y * outcomes_.width() + x + i);
      pixel.point = support.point;
      pixel.doubts = DoubtsOf(support);
      AddViews(*run, i, &pixel.views);
    } else {
      Note(pass, x + i, y, outcome, block);
    }
  }
}

void ImageFuser::RateRows(int begin, int end, Array2D<float>* confidence) const {
  SupportRun run(neighbors_);
  for (int y = begin; y < end; ++y) {
    for (int x = 0; x < outcomes_.width(); x += kRunLength) {
      for (const Pass pass : {Pass::kAll, Pass::kHoles}) {
        const RunBits wanted = PixelsOf(pass, x, y);
        if (wanted != 0) RateRun(pass, x, y, wanted, &run, confidence);
      }
    }
  }
}

RunBits ImageFuser::PixelsOf(Pass pass, int x, int y) const {
  RunBits pixels = 0;
  for (int i = 0; i < kRunLength && x + i < outcomes_.width(); ++i) {
    const FusionPixel& pixel = (*reference_.map)(x + i, y);
    const bool fills_hole = (pixel.flags & FusionPixel::kEmitted) != 0 && outcomes_(x + i, y) != PixelOutcome::kFused;
    if (pixel.depth > 0 && fills_hole == (pass == Pass::kHoles)) pixels |= RunBits{1} << i;
  }
  return pixels;
}

void ImageFuser::RateRun(Pass pass, int x, int y, RunBits wanted, SupportRun* run, Array2D<float>* confidence) const {
  FusionGates gates = GatesOf(pass);
  gates.max_coarsening = 0;  // no image samples so finely that it covers anything
  DecideRun(neighbors_, gates, MakeRun(x, y, wanted), run);
  PointRater rater;
  for (int i = 0; i < kRunLength; ++i) {
    if (!HasPixel(wanted, i)) continue;
    const PixelSupport support = SupportOf(*run, i);
    rater.Add(support.point, DoubtsOf(support));
  }
  rater.Rate();
  for (int i = 0, number = 0; i < kRunLength; ++i) {
    if (HasPixel(wanted, i)) (*confidence)(x + i, y) = rater.ConfidenceOf(number++);
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

void ImageFuser::Emit(Pass pass, std::span<const FusedPixel> pixels, FusedBlock* block) {
  const std::uint32_t width = static_cast<std::uint32_t>(outcomes_.width());
  for (std::size_t begin = 0; begin < pixels.size(); begin += PointRater::kSize) {
    const auto some = pixels.subspan(begin, std::min<std::size_t>(PointRater::kSize, pixels.size() - begin));
    PointRater rater;
    for (const FusedPixel& pixel : some) rater.Add(pixel.point, pixel.doubts);
    rater.Rate();
    for (int i = 0; i < rater.size(); ++i) {
      const FusedPixel& pixel = some[static_cast<std::size_t>(i)];
      const int x = static_cast<int>(pixel.pixel % width), y = static_cast<int>(pixel.pixel / width);
      const PixelOutcome outcome = EmitPixel(x, y, pixel, rater.ConfidenceOf(i), block);
      if (keeps_terms_ && outcome == PixelOutcome::kFused) block->terms.push_back(rater.TermsOf(i));
      Note(pass, x, y, outcome, block);
    }
  }
}

PixelOutcome ImageFuser::EmitPixel(int x, int y, const FusedPixel& pixel, float confidence, FusedBlock* block) const {
  if (confidence < min_confidence_) return PixelOutcome::kImprobable;
  const PointSupport& support = pixel.point;
  const Vec3f ray = {rays_.Ray(x + 0.5f, 0).x, rays_.Ray(0, y + 0.5f).y, 1.0f};
  PointCandidate candidate;
  candidate.point = (*reference_.map)(x, y).depth * (1 + support.relative_depth) * ray;
  candidate.confidence = std::clamp(static_cast<int>(100 * confidence + 0.5f), 1, 100);
  candidate.normal = support.normal_sum;
  std::copy(std::begin(support.rgb_sum), std::end(support.rgb_sum), candidate.rgb_sum);
  candidate.num_views = support.num_views;
  candidate.num_inferred = support.num_inferred;
  block->views.push_back(reference_.index);
  pixel.views.ForEach([&](int k) { block->views.push_back(neighbors_[static_cast<std::size_t>(k)].image); });
  return EmitPoint(reference_.camera.pose, box_, candidate, block);
}

// Holes are found by the outcomes of the first pass, also while others of them are being filled.
void ImageFuser::Note(Pass pass, int x, int y, PixelOutcome outcome, FusedBlock* block) {
  const bool is_fused = outcome == PixelOutcome::kFused;
  if (is_fused) (*reference_.map)(x, y).flags |= FusionPixel::kEmitted;
  if (pass == Pass::kAll) {
    outcomes_(x, y) = outcome;
    ++block->outcomes[outcome];
  } else if (is_fused) {
    --block->outcomes[outcomes_(x, y)];
    ++block->outcomes[outcome];
  }
}

}  // namespace phi

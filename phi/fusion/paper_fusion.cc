#include "phi/fusion/paper_fusion.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

#include "phi/base/cancellation.h"
#include "phi/fusion/neighbor_lookup.h"

namespace phi {
namespace {

constexpr std::uint32_t kUnclaimed = ~std::uint32_t{0};
constexpr std::size_t kBitsPerWord = 64;

bool IsLeft(const FusionPixel& pixel) { return pixel.depth > 0 && (pixel.flags & FusionPixel::kMerged) == 0; }

// `*value` becomes the smaller of the two.
void AtomicMin(std::uint32_t* value, std::uint32_t other) {
  std::atomic_ref<std::uint32_t> current(*value);
  std::uint32_t seen = current.load(std::memory_order_relaxed);
  while (other < seen && !current.compare_exchange_weak(seen, other, std::memory_order_relaxed)) {
  }
}

}  // namespace

PaperFuser::PaperFuser(const Image& reference, const std::vector<Image>& to_come,
                       const FusionOptions& options, const BoundingBox* box)
    : reference_(reference),
      rays_(MakeRayModel(reference.camera.pinhole)),
      max_depth_error_(static_cast<float>(options.max_depth_error)),
      min_num_views_(options.min_num_views),
      max_num_views_(options.max_num_views),
      box_(box),
      num_words_((to_come.size() + kBitsPerWord - 1) / kBitsPerWord),
      taken_in_(num_words_ * reference.map->size()),
      counts_(reference.map->size()) {
  for (const Image& image : to_come) {
    others_.push_back({image.index, MakeRelativeView(reference.camera, image.camera), image.map});
  }
  std::vector<std::uint32_t> claims;
  for (std::size_t k = 0; k < others_.size(); ++k) TakeIn(k, &claims);
}

template <class Function>
void PaperFuser::ForEachPixelLeft(const Function& function) const {
  const int width = reference_.map->width();
  tbb::parallel_for(0, reference_.map->height(), [&](int y) {
    ThrowIfCancelled();
    for (int x = 0; x < width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
      if (IsLeft(reference_.map->data()[pixel])) function(pixel, ReferencePoint(x, y));
    }
  });
}

Vec3f PaperFuser::ReferencePoint(int x, int y) const {
  return (*reference_.map)(x, y).depth * rays_.Ray(x + 0.5f, y + 0.5f);
}

std::int64_t PaperFuser::Find(const Other& other, Vec3f point) const {
  const Vec3f x = other.view.rotation * point + other.view.translation;
  const RayModel& k = other.view.source;
  const ImagePoint seen = ProjectPoint(k, x);
  if (!InsideImage(k, x, seen)) return -1;
  return static_cast<std::int64_t>(seen.v) * k.width + static_cast<std::int64_t>(seen.u);
}

Vec3f PaperFuser::PointOf(const Other& other, std::int64_t pixel) const {
  const RayModel& k = other.view.source;
  const float u = static_cast<float>(pixel % k.width) + 0.5f, v = static_cast<float>(pixel / k.width) + 0.5f;
  const Vec3f theirs = other.map->data()[pixel].depth * k.Ray(u, v);
  return TransposedTimes(other.view.rotation, theirs - other.view.translation);
}

std::int64_t PaperFuser::FindAgreeing(const Other& other, Vec3f point) const {
  const std::int64_t pixel = Find(other, point);
  if (pixel < 0 || !IsLeft(other.map->data()[pixel])) return -1;
  return Norm(PointOf(other, pixel) - point) < max_depth_error_ * point.z ? pixel : -1;
}

void PaperFuser::TakeIn(std::size_t k, std::vector<std::uint32_t>* claims) {
  const Other& other = others_[k];
  claims->assign(other.map->size(), kUnclaimed);
  ForEachPixelLeft([&](std::size_t pixel, Vec3f point) {
    if (counts_[pixel] + 1 >= max_num_views_) return;
    const std::int64_t theirs = FindAgreeing(other, point);
    if (theirs >= 0) AtomicMin(&(*claims)[theirs], static_cast<std::uint32_t>(pixel));
  });
  ForEachPixelLeft([&](std::size_t pixel, Vec3f point) {
    const std::int64_t theirs = Find(other, point);
    if (theirs < 0 || (*claims)[theirs] != pixel) return;
    other.map->data()[theirs].flags |= FusionPixel::kMerged;
    taken_in_[pixel * num_words_ + k / kBitsPerWord] |= std::uint64_t{1} << k % kBitsPerWord;
    ++counts_[pixel];
  });
}

FusedBlock PaperFuser::FuseRows(int begin, int end) const {
  FusedBlock block;
  for (int y = begin; y < end; ++y) {
    for (int x = 0; x < reference_.map->width(); ++x) ++block.outcomes[FusePixel(x, y, &block)];
  }
  return block;
}

PixelOutcome PaperFuser::FusePixel(int x, int y, FusedBlock* block) const {
  const FusionPixel& own = (*reference_.map)(x, y);
  if (!(own.depth > 0)) return PixelOutcome::kNoDepth;
  if (!IsLeft(own)) return PixelOutcome::kCovered;
  const std::size_t pixel = static_cast<std::size_t>(y) * reference_.map->width() + x;
  if (counts_[pixel] + 1 < min_num_views_) return PixelOutcome::kDepth;

  const Vec3f point = ReferencePoint(x, y);
  PointCandidate candidate{.point = {0, 0, 0}, .normal = {0, 0, 0}};
  const auto merge = [&](std::uint32_t image, const FusionPixel& merged, Vec3f at, Vec3f normal) {
    candidate.point = candidate.point + at;
    candidate.normal = candidate.normal + normal;
    for (int c = 0; c < 3; ++c) candidate.rgb_sum[c] += merged.rgb[c];
    ++candidate.num_views;
    candidate.num_inferred += (merged.flags & FusionPixel::kInferred) != 0;
    block->views.push_back(image);
  };
  merge(reference_.index, own, point, UnpackNormal(own.normal));
  for (std::size_t k = 0; k < others_.size(); ++k) {
    if ((taken_in_[pixel * num_words_ + k / kBitsPerWord] >> k % kBitsPerWord & 1) == 0) continue;
    const Other& other = others_[k];
    const std::int64_t theirs = Find(other, point);
    const FusionPixel& taken = other.map->data()[theirs];
    merge(other.index, taken, PointOf(other, theirs),
          TransposedTimes(other.view.rotation, UnpackNormal(taken.normal)));
  }
  candidate.point = (1.0f / static_cast<float>(candidate.num_views)) * candidate.point;
  return EmitPoint(reference_.camera.pose, box_, candidate, block);
}

}  // namespace phi

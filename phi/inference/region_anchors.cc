#include "phi/inference/region_anchors.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>
#include <tuple>
#include <utility>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

constexpr int kMaxPoints = 8192;  // of a region, about: larger ones are sampled

// A bijection: no two pixels share a value. Draws and samples go by this number and not by a place in a list, so that an
// anchor more or less changes only the draws that hit it.
std::uint32_t PixelHash(std::uint32_t pixel) {
  pixel ^= pixel >> 16;
  pixel *= 0x85EBCA6Bu;
  pixel ^= pixel >> 13;
  pixel *= 0xC2B2AE35u;
  return pixel ^ pixel >> 16;
}

// By hash, which pixels of two views may share.
bool Before(const RegionPoint& p, const RegionPoint& q) {
  return std::tie(p.hash, p.x, p.y, p.w) < std::tie(q.hash, q.x, q.y, q.w);
}

// In the order of Before. The hashes are uniform: of as many buckets as points each gets about one, and few are out of place after
// that.
std::vector<RegionPoint> Sorted(const std::vector<RegionPoint>& points) {
  const std::uint64_t n = points.size();
  const auto bucket = [n](const RegionPoint& p) { return static_cast<std::size_t>(p.hash * n >> 32); };
  std::vector<std::uint32_t> next(n + 1, 0);  // place for a bucket's next point
  for (const RegionPoint& p : points) ++next[bucket(p) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<RegionPoint> sorted = points;
  for (const RegionPoint& p : points) sorted[next[bucket(p)]++] = p;
  for (std::size_t i = 1; i < n; ++i) {
    for (std::size_t k = i; k > 0 && Before(sorted[k], sorted[k - 1]); --k) std::swap(sorted[k], sorted[k - 1]);
  }
  return sorted;
}

// Clues stand in for measurements: where most points were measured, they could only say otherwise.
void DropNeedlessClues(std::vector<RegionPoint>* points) {
  const auto num_measured = std::count_if(points->begin(), points->end(), [](const RegionPoint& p) { return p.is_measured; });
  if (2 * num_measured > std::ssize(*points)) std::erase_if(*points, [](const RegionPoint& p) { return !p.is_measured; });
}

void SetTolerances(const AnchorTolerance& tolerance, std::vector<RegionPoint>* points) {
  const std::size_t size = points->size();
  std::vector<float> u(size), v(size), depth(size), deviations(size);
  for (std::size_t i = 0; i < size; ++i) {
    const RegionPoint& p = (*points)[i];
    u[i] = p.x + 0.5f, v[i] = p.y + 0.5f, depth[i] = 1 / p.w;
  }
  tolerance.precision.FindRelativeDeviations(u.data(), v.data(), depth.data(), size, deviations.data());
  for (std::size_t i = 0; i < size; ++i) (*points)[i].tolerance = tolerance.Of(deviations[i], (*points)[i].w);
}

std::int32_t FetchAdd(std::int32_t* value, std::int32_t summand) {
  return std::atomic_ref<std::int32_t>(*value).fetch_add(summand, std::memory_order_relaxed);
}

// Of each region.
struct Counts {
  std::int32_t pixels = 0;
  std::int32_t with_anchor = 0;  // of these
  std::int32_t pooled = 0;       // other views' anchors
};

std::vector<Counts> CountAnchors(const ImageRegions& regions, ArrayView2D<const float> anchors, std::span<const PooledAnchor> pooled) {
  std::vector<Counts> counts(static_cast<std::size_t>(regions.num_regions));
  tbb::parallel_for(0, anchors.height, [&](int y) {
    ForRunsOfRow(regions, y, [&](std::int32_t region, int begin, int end) {
      if (region < 0) return;
      std::int32_t count = 0;
      for (int x = begin; x < end; ++x) count += anchors(x, y) > 0;
      Counts& own = counts[static_cast<std::size_t>(region)];
      FetchAdd(&own.pixels, end - begin);
      if (count > 0) FetchAdd(&own.with_anchor, count);
    });
  });
  for (const PooledAnchor& anchor : pooled) {
    const std::int32_t region = regions.region(anchor.PixelX(), anchor.PixelY());
    if (region >= 0) ++counts[static_cast<std::size_t>(region)].pooled;
  }
  return counts;
}

}  // namespace

RegionAnchors::RegionAnchors(const ImageRegions& regions, ArrayView2D<const float> anchors,
                             std::span<const PooledAnchor> pooled, int min_anchors, ArrayView2D<const PixelState> states)
    : anchors_(anchors), pooled_(pooled), states_(states), index_(static_cast<std::size_t>(regions.num_regions), -1) {
  const std::vector<Counts> counts = CountAnchors(regions, anchors, pooled);
  std::int64_t num_anchors = 0;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    const std::int32_t count = counts[r].with_anchor + counts[r].pooled;
    if (count < min_anchors) continue;
    const double share = std::min(1.0, static_cast<double>(kMaxPoints) / count);
    index_[r] = static_cast<std::int32_t>(regions_.size());
    regions_.push_back({static_cast<std::int32_t>(r), static_cast<std::uint32_t>(share * 4294967295.0), num_anchors,
                        2 * counts[r].with_anchor <= counts[r].pixels});
    num_anchors += count;
  }
  members_ = std::make_unique_for_overwrite<Member[]>(static_cast<std::size_t>(num_anchors));
  ListMembers(regions);
}

void RegionAnchors::ListMembers(const ImageRegions& regions) {
  tbb::parallel_for(0, anchors_.height, [&](int y) {
    std::vector<Member> found(static_cast<std::size_t>(anchors_.width));
    ForRunsOfRow(regions, y, [&](std::int32_t region, int begin, int end) {
      const std::int32_t k = region < 0 ? -1 : index_[static_cast<std::size_t>(region)];
      if (k < 0) return;
      Region& own = regions_[static_cast<std::size_t>(k)];
      // Written and passed over or not, for a processor cannot foretell a hash.
      std::size_t num_found = 0;
      for (int x = begin; x < end; ++x) {
        const std::int32_t pixel = y * anchors_.width + x;
        const unsigned has_depth = anchors_(x, y) > 0 ? 1 : 0;
        const unsigned is_drawn = PixelHash(static_cast<std::uint32_t>(pixel)) <= own.max_hash ? 1 : 0;
        found[num_found] = pixel;
        num_found += has_depth & is_drawn;
      }
      Append({found.data(), num_found}, &own);
    });
  });
  for (std::size_t k = 0; k < pooled_.size(); ++k) {
    const std::int32_t region = regions.region(pooled_[k].PixelX(), pooled_[k].PixelY());
    const std::int32_t own = region < 0 ? -1 : index_[static_cast<std::size_t>(region)];
    if (own < 0 || pooled_[k].hash > regions_[static_cast<std::size_t>(own)].max_hash) continue;
    Append(std::array{~static_cast<Member>(k)}, &regions_[static_cast<std::size_t>(own)]);
  }
}

// Several threads at once.
void RegionAnchors::Append(std::span<const Member> members, Region* region) {
  if (members.empty()) return;
  const std::int32_t first = FetchAdd(&region->num_members, static_cast<std::int32_t>(members.size()));
  std::copy(members.begin(), members.end(), &members_[static_cast<std::size_t>(region->begin + first)]);
}

// Without its tolerance. The hash that chose it, once more, is uniform again among those that were chosen.
RegionPoint RegionAnchors::PointOf(Member member) const {
  if (member < 0) {
    const PooledAnchor& pooled = pooled_[static_cast<std::size_t>(~member)];
    return {pooled.x, pooled.y, pooled.inverse_depth, 0, PixelHash(pooled.hash), pooled.is_measured};
  }
  const int x = member % anchors_.width, y = member / anchors_.width;
  const std::uint32_t chosen_by = PixelHash(static_cast<std::uint32_t>(member));
  const bool is_measured = states_.data == nullptr || IsMeasured(states_(x, y));
  return {static_cast<float>(x), static_cast<float>(y), anchors_(x, y), 0, PixelHash(chosen_by), is_measured};
}

std::vector<RegionPoint> RegionAnchors::Points(std::size_t k, const AnchorTolerance& tolerance) const {
  const Region& region = regions_[k];
  std::vector<RegionPoint> points;
  points.reserve(static_cast<std::size_t>(region.num_members));
  const Member* members = &members_[static_cast<std::size_t>(region.begin)];
  for (std::int32_t i = 0; i < region.num_members; ++i) points.push_back(PointOf(members[i]));
  DropNeedlessClues(&points);
  points = Sorted(points);  // threads found them in any order
  SetTolerances(tolerance, &points);
  return points;
}

}  // namespace phi

#include "colmap_ext/evaluation/space_blocks.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <numeric>

#include "phi/base/error.h"

namespace colmap_ext {
namespace {

using phi::Vec3f;

float& Axis(Vec3f& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
float Axis(const Vec3f& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

void Grow(Box& box, const std::vector<Vec3f>& points) {
  for (const Vec3f& p : points) {
    for (int axis = 0; axis < 3; ++axis) {
      Axis(box.lower, axis) = std::min(Axis(box.lower, axis), Axis(p, axis));
      Axis(box.upper, axis) = std::max(Axis(box.upper, axis), Axis(p, axis));
    }
  }
}

std::vector<std::uint32_t> Identity(std::size_t size) {
  if (size > std::numeric_limits<std::uint32_t>::max()) {
    throw phi::ResourceError("a cloud of more than 4294967295 points cannot be evaluated; thin it first");
  }
  std::vector<std::uint32_t> order(size);
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

class Splitter {
 public:
  Splitter(const std::vector<Vec3f>& queries, const std::vector<Vec3f>& references, SpaceBlocks& blocks,
           const SpaceBlockOptions& options)
      : queries_(queries), references_(references), blocks_(blocks), options_(options) {}

  std::vector<SpaceBlock> Split(const SpaceBlock& block) {
    const std::size_t size =
        (block.query_end - block.query_begin) + (block.reference_end - block.reference_begin);
    const int axis = LongestAxis(block.box);
    const float lower = Axis(block.box.lower, axis), upper = Axis(block.box.upper, axis);
    if (size <= options_.max_points || !(upper - lower > 2 * options_.min_side)) return {block};
    const float plane = std::clamp(Median(block, axis), lower + options_.min_side, upper - options_.min_side);
    if (!(plane > lower && plane < upper)) return {block};

    const std::size_t query_middle =
        Partition(queries_, blocks_.query_order, block.query_begin, block.query_end, axis, plane);
    const std::size_t reference_middle = Partition(references_, blocks_.reference_order,
                                                   block.reference_begin, block.reference_end, axis, plane);
    SpaceBlock below = block, above = block;
    Axis(below.box.upper, axis) = Axis(above.box.lower, axis) = plane;
    below.query_end = above.query_begin = query_middle;
    below.reference_end = above.reference_begin = reference_middle;
    std::vector<SpaceBlock> left, right;
    tbb::parallel_invoke([&] { left = Split(below); }, [&] { right = Split(above); });
    left.insert(left.end(), right.begin(), right.end());
    return left;
  }

 private:
  static int LongestAxis(const Box& box) {
    const Vec3f side = box.upper - box.lower;
    if (side.x >= side.y && side.x >= side.z) return 0;
    return side.y >= side.z ? 1 : 2;
  }

  // Of an even sample of both clouds: enough to balance, and cheap.
  float Median(const SpaceBlock& block, int axis) const {
    std::vector<float> sample;
    const auto take = [&](const std::vector<Vec3f>& points, const std::vector<std::uint32_t>& order,
                          std::size_t begin, std::size_t end) {
      const std::size_t step = std::max<std::size_t>(1, (end - begin) / 500);
      for (std::size_t i = begin; i < end; i += step) sample.push_back(Axis(points[order[i]], axis));
    };
    take(queries_, blocks_.query_order, block.query_begin, block.query_end);
    take(references_, blocks_.reference_order, block.reference_begin, block.reference_end);
    std::nth_element(sample.begin(), sample.begin() + sample.size() / 2, sample.end());
    return sample[sample.size() / 2];
  }

  static std::size_t Partition(const std::vector<Vec3f>& points, std::vector<std::uint32_t>& order,
                               std::size_t begin, std::size_t end, int axis, float plane) {
    const auto middle = std::partition(order.begin() + begin, order.begin() + end,
                                       [&](std::uint32_t i) { return Axis(points[i], axis) < plane; });
    return static_cast<std::size_t>(middle - order.begin());
  }

  const std::vector<Vec3f>& queries_;
  const std::vector<Vec3f>& references_;
  SpaceBlocks& blocks_;
  const SpaceBlockOptions& options_;
};

bool Overlap(const Box& a, const Box& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y &&
         b.lower.y <= a.upper.y && a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}

}  // namespace

std::vector<Vec3f> SpaceBlocks::ReferencesAround(std::size_t block, const std::vector<Vec3f>& references,
                                                 float margin) const {
  const Vec3f grow{margin, margin, margin};
  const Box wanted{blocks[block].box.lower - grow, blocks[block].box.upper + grow};
  std::vector<Vec3f> found;
  for (const SpaceBlock& other : blocks) {
    if (!Overlap(wanted, other.box)) continue;
    for (std::size_t i = other.reference_begin; i < other.reference_end; ++i) {
      const Vec3f& p = references[reference_order[i]];
      if (Overlap(wanted, {p, p})) found.push_back(p);
    }
  }
  return found;
}

SpaceBlocks SplitIntoBlocks(const std::vector<Vec3f>& queries, const std::vector<Vec3f>& references,
                            const SpaceBlockOptions& options) {
  SpaceBlocks result;
  result.query_order = Identity(queries.size());
  result.reference_order = Identity(references.size());
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  SpaceBlock all{{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}},
                 0,
                 queries.size(),
                 0,
                 references.size()};
  Grow(all.box, queries);
  Grow(all.box, references);
  result.blocks = Splitter(queries, references, result, options).Split(all);
  return result;
}

}  // namespace colmap_ext

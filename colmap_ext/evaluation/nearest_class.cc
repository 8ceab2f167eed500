#include "colmap_ext/evaluation/nearest_class.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <flann/flann.hpp>

#include "colmap_ext/evaluation/space_blocks.h"
#include "phi/base/cancellation.h"

namespace colmap_ext {
namespace {

using phi::Vec3f;
using Distance = flann::L2_3D<float>;

// A point in a tree: gathered copy, FLANN's reordered copy, its index and its share of the nodes.
constexpr std::size_t kBytesPerTreePoint = 48;
constexpr std::size_t kMinBlockPoints = 20000;

// The nearest neighbour within a bound. Once a neighbour is within the smallest tolerance nothing nearer can
// change the class, so the search ends.
class NearestWithin final : public flann::ResultSet<float> {
 public:
  NearestWithin(float bound_squared, float enough_squared)
      : distance_squared_(bound_squared), enough_squared_(enough_squared) {}

  bool full() const override { return true; }
  void addPoint(float distance_squared, size_t) override {
    if (distance_squared > distance_squared_) return;
    found_ = true;
    nearest_squared_ = distance_squared;
    distance_squared_ = distance_squared <= enough_squared_ ? 0.0f : distance_squared;
  }
  float worstDist() const override { return distance_squared_; }

  bool found() const { return found_; }
  float nearest_squared() const { return nearest_squared_; }

 private:
  float distance_squared_, enough_squared_;
  float nearest_squared_ = 0;
  bool found_ = false;
};

std::vector<float> Squares(const std::vector<double>& values) {
  std::vector<float> squares;
  for (double v : values) squares.push_back(static_cast<float>(v * v));
  return squares;
}

std::size_t BlockSize(std::size_t num_points, std::size_t working_memory) {
  const std::size_t threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const std::size_t balanced = std::max(kMinBlockPoints, num_points / (8 * threads));
  return std::clamp(working_memory / threads / kBytesPerTreePoint, kMinBlockPoints, balanced);
}

void ClassifyBlock(const std::vector<Vec3f>& queries, const SpaceBlocks& blocks, std::size_t block,
                   std::vector<Vec3f> references, const std::vector<float>& squares,
                   std::vector<ToleranceClass>& classes) {
  flann::Matrix<float> data(&references[0].x, references.size(), 3);
  flann::KDTreeSingleIndex<Distance> tree(data, flann::KDTreeSingleIndexParams(12));
  tree.buildIndex();
  const flann::SearchParams exact(flann::FLANN_CHECKS_UNLIMITED);
  // FLANN accepts strictly nearer points only; the bound itself counts as within the tolerance.
  const float bound = std::nextafter(squares.back(), 2 * squares.back());
  for (std::size_t i = blocks.blocks[block].query_begin; i < blocks.blocks[block].query_end; ++i) {
    const std::uint32_t query = blocks.query_order[i];
    NearestWithin nearest(bound, squares.front());
    tree.findNeighbors(nearest, &queries[query].x, exact);
    if (!nearest.found()) continue;
    const auto first = std::lower_bound(squares.begin(), squares.end(), nearest.nearest_squared());
    classes[query] = static_cast<ToleranceClass>(first - squares.begin());
  }
}

}  // namespace

std::vector<ToleranceClass> ClassifyByNearest(const std::vector<Vec3f>& queries,
                                              const std::vector<Vec3f>& references,
                                              const std::vector<double>& tolerances,
                                              std::size_t working_memory) {
  std::vector<ToleranceClass> classes(queries.size(), static_cast<ToleranceClass>(tolerances.size()));
  if (queries.empty() || references.empty()) return classes;
  const std::vector<float> squares = Squares(tolerances);
  const float margin = static_cast<float>(tolerances.back()) * 1.001f;
  const SpaceBlocks blocks = SplitIntoBlocks(
      queries, references, {BlockSize(queries.size() + references.size(), working_memory), margin});
  tbb::parallel_for(std::size_t{0}, blocks.blocks.size(), [&](std::size_t block) {
    phi::ThrowIfCancelled();
    if (blocks.blocks[block].query_begin == blocks.blocks[block].query_end) return;
    std::vector<Vec3f> around = blocks.ReferencesAround(block, references, margin);
    if (!around.empty()) ClassifyBlock(queries, blocks, block, std::move(around), squares, classes);
  });
  return classes;
}

}  // namespace colmap_ext

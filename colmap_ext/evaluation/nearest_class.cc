#include "colmap_ext/evaluation/nearest_class.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <flann/flann.hpp>
#include <optional>

#include "phi/base/cancellation.h"

namespace colmap_ext {
namespace {

using phi::Vec3f;
using Distance = flann::L2_3D<float>;
using Tree = flann::KDTreeSingleIndex<Distance>;

// A point in a tree: FLANN's reordered copy, pointer, index and its share of the nodes.
constexpr std::size_t kBytesPerTreePoint = 40;
constexpr std::size_t kMinTreePoints = 1 << 16, kMaxTreePoints = 1 << 20, kQueriesAtOnce = 1 << 13;
constexpr int kLeafPoints = 24;
constexpr std::size_t kLookedAt = 16;  // on both sides of what lowered the query before

// Lowers a class by the points that a search meets. Only points that lower it further are searched for: none once it is 0.
class LoweredClass final : public flann::ResultSet<float> {
 public:
  // `bounds`: by class, what squared distances that lower it are below.
  LoweredClass(ToleranceClass before, const std::vector<float>& bounds) : class_(before), bounds_(bounds) {}

  bool full() const override { return true; }
  void addPoint(float distance_squared, std::size_t index) override {
    for (; distance_squared < bounds_[class_]; --class_) last_ = first_of_tree + index;
  }
  float worstDist() const override { return bounds_[class_]; }

  ToleranceClass Class() const { return class_; }
  std::size_t last() const { return last_; }  // the point that lowered it last

  std::size_t first_of_tree = 0;

 private:
  ToleranceClass class_;
  const std::vector<float>& bounds_;
  std::size_t last_ = 0;
};

Eigen::Map<const Eigen::Vector3f> PointAsEigen(const Vec3f& point) {
  return Eigen::Map<const Eigen::Vector3f>(&point.x);
}

// References that follow one another.
struct TreePiece {
  std::size_t first;
  Eigen::AlignedBox3f box;
  Tree tree;

  TreePiece(const std::vector<Vec3f>& references, std::size_t begin, std::size_t end)
      : first(begin),
        // FLANN asks for what it could change, and changes nothing.
        tree(flann::Matrix<float>(const_cast<float*>(&references[begin].x), end - begin, 3),
             flann::KDTreeSingleIndexParams(kLeafPoints)) {
    for (std::size_t i = begin; i < end; ++i) box.extend(PointAsEigen(references[i]));
    tree.buildIndex();
  }
};

using TreePieces = std::vector<std::optional<TreePiece>>;

// Few, since each is another search where boxes overlap; as many as threads, since each is built by one.
TreePieces PiecesOf(const std::vector<Vec3f>& references, std::size_t begin, std::size_t end) {
  const auto threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const std::size_t size = std::clamp((end - begin) / threads + 1, kMinTreePoints, kMaxTreePoints);
  TreePieces pieces((end - begin + size - 1) / size);
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) {
    phi::ThrowIfCancelled();
    const std::size_t first = begin + i * size;
    pieces[i].emplace(references, first, std::min(first + size, end));
  });
  return pieces;
}

struct NearestSearch {
  const std::vector<Vec3f>& queries;
  const std::vector<Vec3f>& references;
  const std::vector<float>& bounds;
  const TreePieces& pieces;

  // Queries that follow one another.
  void Lower(std::size_t begin, std::size_t end, std::vector<ToleranceClass>& classes) const {
    const std::vector<const TreePiece*> near = PiecesNear(begin, end);
    std::size_t last = 0;
    for (std::size_t i = begin; i < end; ++i) {
      if (classes[i] == 0 || (classes[i] & kNotCounted)) continue;
      LoweredClass lowered(classes[i], bounds);
      // What was near the query before is often near this one, too.
      for (std::size_t away = 0; away < kLookedAt && lowered.Class() > 0; ++away) {
        LookAt(i, last + away, lowered);
        if (away > 0 && away <= last) LookAt(i, last - away, lowered);
      }
      for (const TreePiece* piece : near) Search(*piece, queries[i], lowered);
      if (lowered.Class() == classes[i]) continue;
      classes[i] = lowered.Class();
      last = lowered.last();
    }
  }

 private:
  std::vector<const TreePiece*> PiecesNear(std::size_t begin, std::size_t end) const {
    Eigen::AlignedBox3f box;
    for (std::size_t i = begin; i < end; ++i) box.extend(PointAsEigen(queries[i]));
    std::vector<const TreePiece*> near;
    for (const std::optional<TreePiece>& piece : pieces) {
      if (piece->box.squaredExteriorDistance(box) < bounds.back()) near.push_back(&*piece);
    }
    return near;
  }

  void LookAt(std::size_t query, std::size_t reference, LoweredClass& lowered) const {
    if (reference >= references.size()) return;
    lowered.addPoint(Distance()(&queries[query].x, &references[reference].x, 3), reference);
  }

  // A box is never farther than a point in it, to the last bit: both sum squares in one order, and rounding keeps order.
  static void Search(const TreePiece& piece, const Vec3f& query, LoweredClass& lowered) {
    if (!(piece.box.squaredExteriorDistance(PointAsEigen(query)) < lowered.worstDist())) return;
    lowered.first_of_tree = piece.first;
    piece.tree.findNeighbors(lowered, &query.x, flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED));
    lowered.first_of_tree = 0;
  }
};

}  // namespace

void LowerToNearest(const std::vector<Vec3f>& queries, const std::vector<Vec3f>& references,
                    const std::vector<double>& tolerances, std::size_t working_memory,
                    std::vector<ToleranceClass>& classes) {
  std::vector<float> bounds{-1.0f};
  for (const double t : tolerances) {
    // FLANN accepts strictly nearer points only; the tolerance itself counts as within.
    const float squared = static_cast<float>(t * t);
    bounds.push_back(std::nextafter(squared, 2 * squared));
  }
  const std::size_t at_once = std::max(working_memory / kBytesPerTreePoint, kMinTreePoints);
  for (std::size_t begin = 0; begin < references.size(); begin += at_once) {
    const TreePieces pieces = PiecesOf(references, begin, std::min(begin + at_once, references.size()));
    const NearestSearch search{queries, references, bounds, pieces};
    // Never more queries at once: a box around many is near many pieces.
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, queries.size(), kQueriesAtOnce),
        [&](const auto& range) {
          phi::ThrowIfCancelled();
          search.Lower(range.begin(), range.end(), classes);
        },
        tbb::simple_partitioner());
  }
}

}  // namespace colmap_ext

// Accuracy, completeness and F1 of a reconstructed cloud against the truth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "colmap_ext/evaluation/scan_beams.h"
#include "phi/base/vec.h"

namespace colmap_ext {

struct CloudEvaluationOptions {
  std::vector<double> tolerances{0.01, 0.02, 0.05, 0.1};  // --tolerances, world units, ascending
  double voxel_size = 0.01;                               // --voxel_size, world units
  std::size_t memory = std::size_t{8} << 30;              // --memory, bytes, over the clouds and the search
  std::string Check() const;
};

// All points relative to one origin, so that single precision holds in geo-registered scenes.
struct CloudPair {
  std::vector<phi::Vec3f> points;  // the reconstruction
  std::vector<bool> counted;       // empty, or whether each point counts for accuracy
  std::vector<bool> inferred;      // empty, or whether each point's depth was inferred: then scored apart
  std::vector<phi::Vec3f> truth;
  // Surfaces that fewer images see than --min_truth_views asks for: there, but not asked for.
  std::vector<phi::Vec3f> truth_left_out;
  // Empty, or how many images see each point of `truth` (255: as many or more).
  std::vector<std::uint8_t> truth_views;
  // Empty: accuracy by the nearest truth point, on one voxel grid. Else ETH3D's protocol: accuracy by the
  // scanners' beams, averages over two voxel grids.
  std::vector<ScanBeams> scans;
};

// The points of one origin alone, each voxel's share taken over these points. Completeness is a matter of all
// points together.
struct OriginAccuracy {
  std::size_t num_counted = 0;
  std::vector<double> accuracy;  // percent, indexed by tolerance
};

// Completeness over the true points that `min_views` to `max_views` images see. Accuracy has no such classes: a
// wrong point lies on no surface.
struct ViewsCompleteness {
  std::string name;  // "2", "3", "4-5", ...
  int min_views = 0, max_views = 0;
  std::size_t num_truth = 0;
  std::vector<double> completeness;  // percent, indexed by tolerance; each voxel's share over these points
};

// Percent, indexed by tolerance.
struct CloudScores {
  std::vector<double> tolerances, accuracy, completeness, f1;
  std::size_t num_points = 0, num_counted = 0, num_truth = 0;
  std::optional<OriginAccuracy> measured, inferred;  // where CloudPair::inferred tells them apart
  // Where truth was left out: accuracy when a point on those surfaces is right too.
  std::optional<std::vector<double>> accuracy_of_all;
  std::vector<ViewsCompleteness> by_views;  // where CloudPair::truth_views is known: classes that hold points
};

// Throws phi::ResourceError when the clouds alone exceed the memory.
CloudScores EvaluateCloud(CloudPair clouds, const CloudEvaluationOptions& options);

}  // namespace colmap_ext

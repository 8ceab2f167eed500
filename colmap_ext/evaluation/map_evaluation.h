// Depth and normal maps against true ones, pixel by pixel.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "phi/base/array2d.h"
#include "phi/base/vec.h"

namespace colmap_ext {

struct MapEvaluationOptions {
  std::filesystem::path maps;      // --depth_maps or --normal_maps: a folder of <image name>.<kind>.bin
  std::filesystem::path truth;     // --truth_depth_maps or --truth_normal_maps
  std::string kind = "geometric";  // --map_type
  double values_per_unit = 1000;   // --truth_depth_scale: of 16-bit PNG truth, per world unit
  std::vector<double> thresholds;  // world units for depths, degrees for normals; ascending
  bool inferred_apart = false;     // --inferred_apart: also by the filled masks beside `maps`
};

// The pixels of one origin, measured or inferred, that have truth and a value.
struct OriginCount {
  std::int64_t num_pixels = 0;
  std::vector<std::int64_t> num_within;  // by threshold: of these, with an error below it
};

// Percent of the pixels that have truth.
struct MapScore {
  std::string image;
  bool found = false;                             // the map file is there; else all shares are 0
  double valid = 0;                               // pixels with a depth or normal
  std::vector<double> within;                     // by threshold: of these, with an error below it
  std::optional<OriginCount> measured, inferred;  // where a filled mask tells them apart
};

struct MapScores {
  std::vector<double> thresholds;
  std::vector<MapScore> images;  // by name
  MapScore Mean() const;         // over images; measured and inferred: sums
};

using FilledMask = phi::Array2D<std::uint8_t>;

// Maps of another size than the truth are read at the nearest pixel. `filled`: null, or a mask of the map's size
// that is not 0 where the map was inferred.
MapScore ScoreDepth(const phi::Array2D<float>& depth, const phi::Array2D<float>& truth,
                    const std::vector<double>& thresholds, const FilledMask* filled = nullptr);
MapScore ScoreNormals(const phi::Array2D<phi::Vec3f>& normals, const phi::Array2D<phi::Vec3f>& truth,
                      const std::vector<double>& thresholds, const FilledMask* filled = nullptr);

MapScores EvaluateDepthMaps(const MapEvaluationOptions& options);
MapScores EvaluateNormalMaps(const MapEvaluationOptions& options);

}  // namespace colmap_ext

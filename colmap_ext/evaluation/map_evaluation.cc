#include "colmap_ext/evaluation/map_evaluation.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/map_shape.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/progress.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

bool IsDepth(float value) { return value > 0 && std::isfinite(value); }

// Counts pixels with truth; `error` returns the error at (x, y) of the truth and (mx, my) of the map, or a
// negative number where the map has no value.
template <typename Map, typename HasTruth, typename Error>
MapScore ScorePixels(const Map& map, const Map& truth, const FilledMask* filled,
                     const std::vector<double>& thresholds, HasTruth has_truth, Error error) {
  std::int64_t num_truth = 0;
  OriginCount measured{0, std::vector<std::int64_t>(thresholds.size(), 0)}, inferred = measured;
  for (int y = 0; y < truth.height(); ++y) {
    const int my = static_cast<int>(static_cast<std::int64_t>(y) * map.height() / truth.height());
    for (int x = 0; x < truth.width(); ++x) {
      if (!has_truth(truth(x, y))) continue;
      ++num_truth;
      const int mx = static_cast<int>(static_cast<std::int64_t>(x) * map.width() / truth.width());
      const double e = error(map(mx, my), truth(x, y));
      if (e < 0) continue;
      OriginCount& count = filled && (*filled)(mx, my) != 0 ? inferred : measured;
      ++count.num_pixels;
      for (std::size_t t = 0; t < thresholds.size(); ++t) count.num_within[t] += e < thresholds[t];
    }
  }
  const double percent = num_truth > 0 ? 100.0 / static_cast<double>(num_truth) : 0;
  MapScore score;
  score.found = true;
  score.valid = percent * static_cast<double>(measured.num_pixels + inferred.num_pixels);
  for (std::size_t t = 0; t < thresholds.size(); ++t) {
    score.within.push_back(percent * static_cast<double>(measured.num_within[t] + inferred.num_within[t]));
  }
  if (filled) {
    score.measured = std::move(measured);
    score.inferred = std::move(inferred);
  }
  return score;
}

void Add(const std::optional<OriginCount>& image, std::optional<OriginCount>& sum) {
  if (!image) return;
  if (!sum) sum = OriginCount{0, std::vector<std::int64_t>(image->num_within.size(), 0)};
  sum->num_pixels += image->num_pixels;
  for (std::size_t t = 0; t < sum->num_within.size(); ++t) sum->num_within[t] += image->num_within[t];
}

// The filled masks of a workspace lie beside its maps: stereo/depth_maps, stereo/filled_masks.
std::filesystem::path FilledMaskFolder(const std::filesystem::path& maps) {
  return std::filesystem::absolute(maps / "x").lexically_normal().parent_path().parent_path() /
         "filled_masks";
}

// Null unless the origins are scored apart. An image without a mask has nothing inferred, as in fusion.
std::optional<FilledMask> ReadFilled(const MapEvaluationOptions& options, const std::string& image, int width,
                                     int height) {
  if (!options.inferred_apart) return std::nullopt;
  const std::filesystem::path path = FilledMaskFolder(options.maps) / (image + ".png");
  if (!std::filesystem::exists(path)) return FilledMask(width, height);
  FilledMask mask = ReadMask(path);
  if (mask.width() != width || mask.height() != height) {
    throw phi::InputError(phi::AboutFile(path) + " is " + std::to_string(mask.width()) + " x " +
                          std::to_string(mask.height()) + " pixels, but the image's map is " +
                          std::to_string(width) + " x " + std::to_string(height));
  }
  return mask;
}

// Of whatever size; stretched, each pixel would be held against another one's truth.
template <typename Map>
void RequireOneShape(const std::filesystem::path& map_path, const Map& map, const std::filesystem::path& truth_path, const Map& truth) {
  if (HasShapeOf(truth.width(), truth.height(), map.width(), map.height())) return;
  throw phi::InputError(phi::AboutFile(map_path) + " is " + SizeText(map.width(), map.height()) + ", but its truth " +
                        truth_path.string() + " is " + SizeText(truth.width(), truth.height()) +
                        ", which is another shape; give the truth of the undistorted image");
}

// `score_files(image, map path, truth path)` reads and compares two files.
template <typename ScoreFiles>
MapScores EvaluateMaps(const MapEvaluationOptions& options, ScoreFiles score_files) {
  const auto truth = FindTruthMaps(options.truth);
  if (options.inferred_apart && !std::filesystem::is_directory(FilledMaskFolder(options.maps))) {
    throw phi::InputError("there is no folder " + phi::AboutFile(FilledMaskFolder(options.maps)) +
                          ", which --inferred_apart needs: it says which pixels were inferred");
  }
  const std::vector<std::pair<std::string, std::filesystem::path>> files(truth.begin(), truth.end());
  MapScores scores;
  scores.thresholds = options.thresholds;
  scores.images.resize(files.size());
  ProgressLine progress(ProgressStage{.name = "comparing maps", .unit = "maps"}, files.size());
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
    const ProgressLine::Task task(&progress);
    phi::ThrowIfCancelled();
    const std::filesystem::path map = options.maps / (files[i].first + "." + options.kind + ".bin");
    MapScore& score = scores.images[i];
    score.within.assign(options.thresholds.size(), 0.0);
    if (std::filesystem::exists(map)) score = score_files(files[i].first, map, files[i].second);
    score.image = files[i].first;
  });
  if (std::none_of(scores.images.begin(), scores.images.end(), [](const MapScore& s) { return s.found; })) {
    throw phi::InputError(phi::AboutFile(options.maps) + " holds no map <image name>." + options.kind +
                          ".bin for any image of " + options.truth.string());
  }
  return scores;
}

}  // namespace

MapScore MapScores::Mean() const {
  MapScore mean;
  mean.image = "mean";
  mean.within.assign(thresholds.size(), 0.0);
  if (images.empty()) return mean;
  const double weight = 1.0 / static_cast<double>(images.size());
  for (const MapScore& image : images) {
    mean.found |= image.found;
    mean.valid += weight * image.valid;
    for (std::size_t t = 0; t < thresholds.size(); ++t) mean.within[t] += weight * image.within[t];
    Add(image.measured, mean.measured);
    Add(image.inferred, mean.inferred);
  }
  return mean;
}

MapScore ScoreDepth(const phi::Array2D<float>& depth, const phi::Array2D<float>& truth,
                    const std::vector<double>& thresholds, const FilledMask* filled) {
  return ScorePixels(
      depth, truth, filled, thresholds, IsDepth,
      [](float d, float g) { return IsDepth(d) ? std::abs(static_cast<double>(d) - g) : -1.0; });
}

MapScore ScoreNormals(const phi::Array2D<phi::Vec3f>& normals, const phi::Array2D<phi::Vec3f>& truth,
                      const std::vector<double>& thresholds, const FilledMask* filled) {
  return ScorePixels(
      normals, truth, filled, thresholds, [](const phi::Vec3f& g) { return phi::Dot(g, g) > 0.5f; },
      [](const phi::Vec3f& n, const phi::Vec3f& g) {
        const double lengths = std::sqrt(static_cast<double>(phi::Dot(n, n)) * phi::Dot(g, g));
        if (!(lengths > 0.25) || !std::isfinite(lengths)) return -1.0;
        return std::acos(std::clamp(phi::Dot(n, g) / lengths, -1.0, 1.0)) * 180 / std::numbers::pi;
      });
}

MapScores EvaluateDepthMaps(const MapEvaluationOptions& options) {
  return EvaluateMaps(options, [&](const std::string& image, const std::filesystem::path& map,
                                   const std::filesystem::path& truth) {
    const phi::Array2D<float> depth = ReadPublishedDepths(map), true_depth = ReadTruthDepth(truth, options.values_per_unit);
    RequireOneShape(map, depth, truth, true_depth);
    const auto filled = ReadFilled(options, image, depth.width(), depth.height());
    return ScoreDepth(depth, true_depth, options.thresholds, filled ? &*filled : nullptr);
  });
}

MapScores EvaluateNormalMaps(const MapEvaluationOptions& options) {
  return EvaluateMaps(options, [&](const std::string& image, const std::filesystem::path& map,
                                   const std::filesystem::path& truth) {
    const phi::Array2D<phi::Vec3f> normals = ReadNormalMap(map), true_normals = ReadNormalMap(truth);
    RequireOneShape(map, normals, truth, true_normals);
    const auto filled = ReadFilled(options, image, normals.width(), normals.height());
    return ScoreNormals(normals, true_normals, options.thresholds, filled ? &*filled : nullptr);
  });
}

}  // namespace colmap_ext

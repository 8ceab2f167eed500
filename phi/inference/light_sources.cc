#include "phi/inference/light_sources.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "phi/base/array2d.h"
#include "phi/base/median.h"

namespace phi {
namespace {

// Of a source of light, its shade: at most so much, and so much of the image's median region's.
constexpr double kMaxShade = 0.03, kMaxOfMedian = 0.125;
constexpr std::size_t kMinSpots = 16;  // fewer show no shade

struct RegionLight {
  std::size_t num_spots;
  double mean;   // grey levels
  double shade;  // from the darkest tenth to the brightest, over the mean
};

// Of the spots of a grid, by column and row. Each spot of a region is asked for the region and for the image.
using Brightness = Array2D<std::optional<float>>;

Brightness BrightnessOf(const SpotGrid& grid, const SpotViews& views) {
  Brightness brightness(grid.columns, grid.rows);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) brightness(column, row) = views.BrightnessHere(grid.At(column, row));
  }
  return brightness;
}

std::optional<RegionLight> LightOf(std::span<const Spot> spots, const SpotGrid& grid, const Brightness& brightness) {
  std::vector<float> levels;
  double sum = 0;
  for (const Spot& spot : spots) {
    const std::optional<float> level = brightness(grid.ColumnOf(spot), grid.RowOf(spot));
    if (!level) continue;
    levels.push_back(*level);
    sum += *level;
  }
  if (levels.size() < kMinSpots || !(sum > 0)) return std::nullopt;
  std::sort(levels.begin(), levels.end());
  const double mean = sum / static_cast<double>(levels.size());
  return RegionLight{levels.size(), mean, (levels[levels.size() * 9 / 10] - levels[levels.size() / 10]) / mean};
}

// Half of the spots lie in regions with no more shade.
double MedianShade(std::span<const std::optional<RegionLight>> lights) {
  std::vector<std::pair<double, std::size_t>> shades;
  std::size_t num_spots = 0;
  for (const std::optional<RegionLight>& light : lights) {
    if (!light) continue;
    shades.emplace_back(light->shade, light->num_spots);
    num_spots += light->num_spots;
  }
  std::sort(shades.begin(), shades.end());
  std::size_t num_so_far = 0;
  for (const auto& [shade, count] : shades) {
    num_so_far += count;
    if (2 * num_so_far >= num_spots) return shade;
  }
  return 0;
}

float MedianBrightness(const Brightness& brightness) {
  std::vector<float> levels;
  for (const std::optional<float>& level : brightness) {
    if (level) levels.push_back(*level);
  }
  return levels.empty() ? 0 : Median(&levels);
}

}  // namespace

std::vector<bool> FindLightSources(std::span<const std::vector<Spot>> regions, const SpotGrid& all, const SpotViews& views,
                                   const Rules& rules) {
  std::vector<bool> are_sources(regions.size());
  if (!rules.IsOn(Rule::kLightSources)) return are_sources;
  const Brightness brightness = BrightnessOf(all, views);
  std::vector<std::optional<RegionLight>> lights;
  for (const std::vector<Spot>& spots : regions) lights.push_back(LightOf(spots, all, brightness));
  const double max_shade = rules.Factor(Rule::kLightSources) * std::min(kMaxShade, kMaxOfMedian * MedianShade(lights));
  const float middle = MedianBrightness(brightness);
  for (std::size_t k = 0; k < regions.size(); ++k) {
    are_sources[k] = lights[k] && lights[k]->shade < max_shade && lights[k]->mean > middle;
  }
  return are_sources;
}

}  // namespace phi

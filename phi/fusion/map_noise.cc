#include "phi/fusion/map_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "phi/base/median.h"
#include "phi/base/wide_vectors.h"
#include "phi/fusion/neighbor_lookup.h"
#include "phi/geometry/device_camera.h"

namespace phi {
namespace {

// Pixels around the one that is smoothed, each way.
constexpr int kRadius = 2;
constexpr int kWindow = 2 * kRadius + 1;
// Pixels of a row that are smoothed together: few enough that their sums stay in the fastest memory.
constexpr int kBlock = 64;
// Depths that differ by more standard deviations belong to another surface.
constexpr float kMaxDeviations = 3;
// About as many pixels are compared with their neighbours to estimate the noise, and at least so many.
constexpr int kWantedSamples = 1 << 16, kFewestSamples = 100;

bool IsMeasured(const FusionPixel& pixel) {
  return pixel.depth > 0 && (pixel.flags & FusionPixel::kInferred) == 0;
}

// The inverse depth over the image around each pixel of a row, by its plane: what it is, 0 without depth, and its slopes for a pixel to the
// right and down. The arrays hold depths and packed normals before.
PHI_WIDE_VECTORS void FindPlanes(const RayModel rays, int y, std::ptrdiff_t width, float* __restrict value, float* __restrict slope_x,
                                 float* __restrict slope_y) {
  for (std::ptrdiff_t x = 0; x < width; ++x) {
    const Vec3f normal = UnpackNormal(slope_x[x], slope_y[x]);
    const float facing = Dot(normal, rays.Ray(static_cast<float>(static_cast<int>(x)) + 0.5f, static_cast<float>(y) + 0.5f));
    const float depth = value[x], inverse = 1 / depth;
    const float right = inverse * normal.x / (facing * rays.fx), down = inverse * normal.y / (facing * rays.fy);
    const bool has_depth = depth > 0, is_grazing = facing >= -kMinRayCosine, has_slope = has_depth & !is_grazing;
    value[x] = has_depth ? inverse : 0;
    slope_x[x] = has_slope ? right : 0;
    slope_y[x] = has_slope ? down : 0;
  }
}

// A row of a map in whole blocks, with a border of pixels without depth; arrays for the compiler's vectors.
struct InverseDepthRow {
  std::vector<float> value, slope_x, slope_y;

  explicit InverseDepthRow(int width) {
    const int size = (width + kBlock - 1) / kBlock * kBlock + 2 * kRadius;
    for (std::vector<float>* v : {&value, &slope_x, &slope_y}) v->assign(static_cast<std::size_t>(size), 0.0f);
  }
  void Read(const FusionMap& map, const RayModel& rays, int y) {
    for (int x = 0; x < map.width(); ++x) {
      const FusionPixel pixel = y < map.height() ? map(x, y) : FusionPixel();
      const std::size_t i = static_cast<std::size_t>(x + kRadius);
      value[i] = pixel.depth;
      slope_x[i] = pixel.normal.x;
      slope_y[i] = pixel.normal.y;
    }
    FindPlanes(rays, y, map.width(), &value[kRadius], &slope_x[kRadius], &slope_y[kRadius]);
  }
};

// Of pixel x of a row, what `other_x` of another row, a step of (dx, dy) away, says of its inverse depth, less that one.
float Difference(const InverseDepthRow& row, int x, const InverseDepthRow& other_row, int other_x, float dx, float dy) {
  const auto here = static_cast<std::size_t>(x + kRadius), other = static_cast<std::size_t>(other_x + kRadius);
  return other_row.value[other] - row.value[here] - 0.5f * dx * (row.slope_x[here] + other_row.slope_x[other]) -
         0.5f * dy * (row.slope_y[here] + other_row.slope_y[other]);
}

// Deviations of pixels from the mean of the two beside them, over the depth.
std::vector<float> SampleDeviations(const FusionMap& map, const RayModel& rays) {
  const double per_sample = static_cast<double>(map.size()) / kWantedSamples;
  const int stride = std::max(1, static_cast<int>(std::sqrt(per_sample)));
  std::vector<float> deviations;
  InverseDepthRow above(map.width()), row(map.width()), below(map.width());
  for (int y = 1; y + 1 < map.height(); y += stride) {
    above.Read(map, rays, y - 1), row.Read(map, rays, y), below.Read(map, rays, y + 1);
    for (int x = 1; x + 1 < map.width(); x += stride) {
      if (!IsMeasured(map(x, y))) continue;
      const auto add = [&](const InverseDepthRow& before, const InverseDepthRow& after, int dx, int dy) {
        if (!IsMeasured(map(x - dx, y - dy)) || !IsMeasured(map(x + dx, y + dy))) return;
        const float fx = static_cast<float>(dx), fy = static_cast<float>(dy);
        const float sum = Difference(row, x, after, x + dx, fx, fy) + Difference(row, x, before, x - dx, -fx, -fy);
        deviations.push_back(std::abs(0.5f * sum) * map(x, y).depth);
      };
      add(row, row, 1, 0);
      add(above, below, 0, 1);
    }
  }
  return deviations;
}

// Of the differences of the pixels around each pixel of a block.
struct BlockSums {
  float count[kBlock] = {}, sum[kBlock] = {}, sum_of_squares[kBlock] = {};
};

// For the block of the middle row that begins at pixel `begin`. `limit`: of a difference, over the inverse depth.
PHI_WIDE_VECTORS void SumDifferences(const std::array<const InverseDepthRow*, kWindow>& rows, std::size_t begin, float limit,
                                     BlockSums* result) {
  BlockSums sums;
  const std::size_t middle = begin + kRadius;
  const float *const value = &rows[kRadius]->value[middle], *const slope_x = &rows[kRadius]->slope_x[middle],
                   *const slope_y = &rows[kRadius]->slope_y[middle];
  for (int dy = -kRadius; dy <= kRadius; ++dy) {
    const InverseDepthRow& row = *rows[static_cast<std::size_t>(dy + kRadius)];
    for (int dx = -kRadius; dx <= kRadius; ++dx) {
      if (dx == 0 && dy == 0) continue;
      const std::size_t first = begin + static_cast<std::size_t>(kRadius + dx);
      const float *const other = &row.value[first], *const other_x = &row.slope_x[first], *const other_y = &row.slope_y[first];
      const float half_x = 0.5f * static_cast<float>(dx), half_y = 0.5f * static_cast<float>(dy);
      for (int i = 0; i < kBlock; ++i) {
        const float difference = other[i] - value[i] - half_x * (slope_x[i] + other_x[i]) - half_y * (slope_y[i] + other_y[i]);
        const bool same = (other[i] > 0) & (std::abs(difference) <= limit * value[i]);
        const float kept = same ? difference : 0.0f;
        sums.count[i] += same ? 1.0f : 0.0f;
        sums.sum[i] += kept;
        sums.sum_of_squares[i] += kept * kept;
      }
    }
  }
  *result = sums;
}

// The block of row y that begins at pixel `begin`.
void SmoothBlock(float noise, const InverseDepthRow& row, const BlockSums& sums, std::size_t begin, int y, FusionMap* map) {
  const std::size_t size = std::min(static_cast<std::size_t>(map->width()) - begin, std::size_t{kBlock});
  FusionPixel* const pixels = &(*map)(static_cast<int>(begin), y);
  for (std::size_t i = 0; i < size; ++i) {
    FusionPixel& pixel = pixels[i];
    if (!IsMeasured(pixel) || sums.count[i] < 1) continue;
    const float value = row.value[begin + i + kRadius], mean = sums.sum[i] / (sums.count[i] + 1);
    const float variance = std::max(0.0f, sums.sum_of_squares[i] - sums.sum[i] * mean) / sums.count[i];
    const float expected = noise * noise * value * value;
    const float share = expected < variance ? expected / variance : 1.0f;
    pixel.depth = 1 / (value + share * mean);
  }
}

}  // namespace

float EstimateNoise(const FusionMap& map, const Pinhole& pinhole) {
  std::vector<float> deviations = SampleDeviations(map, MakeRayModel(pinhole));
  if (deviations.size() < static_cast<std::size_t>(kFewestSamples)) return 0;
  // Of a normal distribution the median is 0.6745 standard deviations; that of a pixel less the mean of two others is
  // sqrt(1.5) times a pixel's.
  return Median(&deviations) / (0.6745f * std::sqrt(1.5f));
}

void SmoothNoise(float noise, const Pinhole& pinhole, FusionMap* map, float scale) {
  const RayModel rays = MakeRayModel(pinhole);
  const float limit = scale * kMaxDeviations * std::sqrt(2.0f) * noise;
  // Rows as they were before smoothing: row y at y % kWindow, without depth where there is none.
  std::vector<InverseDepthRow> rows(kWindow, InverseDepthRow(map->width()));
  const auto row = [&](int y) -> InverseDepthRow& {
    return rows[static_cast<std::size_t>((y + kWindow) % kWindow)];
  };
  for (int y = 0; y < kRadius; ++y) row(y).Read(*map, rays, y);
  for (int y = 0; y < map->height(); ++y) {
    row(y + kRadius).Read(*map, rays, y + kRadius);
    std::array<const InverseDepthRow*, kWindow> around;
    for (int i = 0; i < kWindow; ++i) around[static_cast<std::size_t>(i)] = &row(y + i - kRadius);
    for (std::size_t begin = 0; begin < static_cast<std::size_t>(map->width()); begin += kBlock) {
      BlockSums sums;
      SumDifferences(around, begin, limit, &sums);
      SmoothBlock(noise, row(y), sums, begin, y, map);
    }
  }
}

}  // namespace phi

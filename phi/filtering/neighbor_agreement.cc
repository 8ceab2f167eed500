#include "phi/filtering/neighbor_agreement.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/whole_array.h"

namespace phi {
namespace {

constexpr int kBandRows = 64;  // judged by one thread

enum class Verdict : std::uint8_t { kAgreeing, kDoubtful, kContradicted };

// A row's planes n . X = offset, and its pixels' own: what loops over x read in vector instructions.
struct PlaneRow {
  std::vector<float> normal_x, normal_y, normal_z, offset;  // offset NaN: no depth
  std::vector<float> depth, ray_x;
  std::vector<float> tolerance;  // of the depth

  PlaneRow(const DepthPrecision& precision, const PlaneMap& map, int y)
      : normal_x(map.width()),
        normal_y(map.width()),
        normal_z(map.width()),
        offset(map.width()),
        depth(map.width()),
        ray_x(map.width()),
        tolerance(map.width(), kMaxNeighborError) {
    const RayModel& rays = precision.reference();
    for (int x = 0; x < map.width(); ++x) {
      const PlaneHypothesis& h = map(x, y);
      const Vec3f ray = rays.Ray(x + 0.5f, y + 0.5f);
      normal_x[x] = h.normal.x;
      normal_y[x] = h.normal.y;
      normal_z[x] = h.normal.z;
      offset[x] = h.depth > 0 ? h.depth * Dot(h.normal, ray) : std::numeric_limits<float>::quiet_NaN();
      depth[x] = h.depth;
      ray_x[x] = ray.x;
      if (h.depth > 0) {
        const float deviation = precision.RelativeDeviation(x + 0.5f, y + 0.5f, h.depth);
        tolerance[x] = std::max(kMaxNeighborError, kMaxNeighborDeviations * deviation);
      }
    }
  }
};

// Neighbours of the pixels of one row.
struct NeighborCounts {
  std::vector<std::int32_t> asked, agreeing;

  // The pixel itself is no neighbour, and always agrees.
  explicit NeighborCounts(int width) : asked(width, -1), agreeing(width, -1) {}

  // Adds the neighbours `shift` columns to the right in the row `planes`. A plane meets a pixel's ray at offset / (n . ray),
  // the pixel's depth where offset = depth (n . ray).
  void Add(const PlaneRow& pixels, float ray_y, const PlaneRow& planes, int shift) {
    const int width = static_cast<int>(asked.size());
    const int begin = std::max(0, -shift), end = std::min(width, width - shift);
    const float *nx = planes.normal_x.data() + shift, *ny = planes.normal_y.data() + shift;
    const float *nz = planes.normal_z.data() + shift, *offset = planes.offset.data() + shift;
    const float *depth = pixels.depth.data(), *ray_x = pixels.ray_x.data();
    const float* tolerance = pixels.tolerance.data();
    std::int32_t *num_asked = asked.data(), *num_agreeing = agreeing.data();
    for (int x = begin; x < end; ++x) {
      const float here = depth[x] * (nx[x] * ray_x[x] + ny[x] * ray_y + nz[x]);
      num_asked[x] += offset[x] == offset[x];
      num_agreeing[x] += std::fabs(offset[x] - here) < tolerance[x] * std::fabs(here);
    }
  }

  Verdict Judge(int x) const {
    if (asked[x] >= kMinNeighborsAsked && 100 * agreeing[x] < kMinPercentAgreeing * asked[x])
      return Verdict::kContradicted;
    return agreeing[x] < kMinNeighborsAgreeing ? Verdict::kDoubtful : Verdict::kAgreeing;
  }
};

void JudgeRows(const DepthPrecision& precision, const PlaneMap& map, int begin, int end,
               Array2D<Verdict>* verdicts) {
  const int first = std::max(begin - kAgreementRadius, 0);
  const int last = std::min(end - 1 + kAgreementRadius, map.height() - 1);
  std::vector<PlaneRow> rows;
  for (int y = first; y <= last; ++y) rows.emplace_back(precision, map, y);
  for (int y = begin; y < end; ++y) {
    NeighborCounts counts(map.width());
    const PlaneRow& pixels = rows[y - first];
    const float ray_y = precision.reference().Ray(0.5f, y + 0.5f).y;
    for (int v = std::max(y - kAgreementRadius, first); v <= std::min(y + kAgreementRadius, last); ++v) {
      for (int shift = -kAgreementRadius; shift <= kAgreementRadius; ++shift)
        counts.Add(pixels, ray_y, rows[v - first], shift);
    }
    for (int x = 0; x < map.width(); ++x) {
      if (pixels.depth[x] > 0) (*verdicts)(x, y) = counts.Judge(x);
    }
  }
}

}  // namespace

void JudgeByNeighbors(const DepthPrecision& precision, MeasurementMap* map) {
  const int height = map->height(), num_bands = (height + kBandRows - 1) / kBandRows;
  Array2D<Verdict> verdicts(map->width(), height, Verdict::kAgreeing);
  tbb::parallel_for(0, num_bands, [&](int band) {
    JudgeRows(precision, map->planes, band * kBandRows, std::min((band + 1) * kBandRows, height), &verdicts);
  });
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Verdict verdict = verdicts.data()[i];
      if (verdict == Verdict::kAgreeing) continue;
      PixelState& state = map->states.data()[i];
      const bool is_clue = verdict == Verdict::kDoubtful && state != PixelState::kFewWitnesses;
      if (is_clue) {
        state = PixelState::kDoubtful;
      } else {
        map->Drop(i);
      }
    }
  });
}

}  // namespace phi

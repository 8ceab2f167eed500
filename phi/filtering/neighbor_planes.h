// How many of the planes around each pixel agree with its depth (neighbor_agreement.h), in vector instructions.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/array2d.h"
#include "phi/base/images.h"
#include "phi/filtering/neighbor_agreement.h"
#include "phi/geometry/device_camera.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi {

// A row's planes n . X = offset, and its pixels' own: what loops over x read in vector instructions.
struct PlaneRow {
  // Element `margin` is the row's first: beside the image nothing has depth, and loops need not ask where it ends.
  int margin;
  std::vector<float> normal_x, normal_y, normal_z, offset;  // offset NaN: no depth
  std::vector<float> depth, ray_x;
  std::vector<float> tolerance;  // of the depth
  float ray_y;                   // of all of them

  // deviations: as ForNeighborCounts'.
  PlaneRow(const RayModel& rays, const PlaneMap& map, const Array2D<float>& deviations, int y, int margin);
};

// Adds to the count of each pixel from `begin` to before `end` how many of the five neighbours in the row `planes`, `spacing` columns
// apart, agree.
void CountAgreeing(const PlaneRow& pixels, const PlaneRow& planes, int spacing, int begin, int end, std::vector<std::int32_t>* counts);

// Calls function(begin, end) for the pieces of a row that hold what is wanted (not 0).
template <class Function>
void ForWantedPieces(const std::uint8_t* wanted, int width, const Function& function) {
  constexpr int kPiece = 64;  // pixels
  for (int begin = 0; begin < width; begin += kPiece) {
    const int end = std::min(begin + kPiece, width);
    if (std::any_of(wanted + begin, wanted + end, [](std::uint8_t w) { return w != 0; })) function(begin, end);
  }
}

// Calls function(y, counts) for all rows, bands of them in parallel: how many of the neighbours of the row's wanted pixels, `spacing`
// pixels apart, agree with each.
// `deviations`: DepthPrecision::RelativeDeviations of the map, of the wanted pixels at least.
template <class Function>
void ForNeighborCounts(const RayModel& rays, const PlaneMap& map, const Mask& wanted, const Array2D<float>& deviations,
                       int spacing, const Function& function) {
  constexpr int kBandRows = 64;
  const int reach = kNeighborRadius * spacing, height = map.height();
  tbb::parallel_for(0, (height + kBandRows - 1) / kBandRows, [&](int band) {
    const int begin = band * kBandRows, end = std::min(begin + kBandRows, height);
    const int first = std::max(begin - reach, 0), last = std::min(end - 1 + reach, height - 1);
    std::vector<PlaneRow> rows;
    for (int y = first; y <= last; ++y) rows.emplace_back(rays, map, deviations, y, reach);
    for (int y = begin; y < end; ++y) {
      std::vector<std::int32_t> counts(map.width(), -1);  // the pixel itself is no neighbour, and always agrees
      const PlaneRow& pixels = rows[y - first];
      ForWantedPieces(&wanted(0, y), map.width(), [&](int piece_begin, int piece_end) {
        for (int v = y - reach; v <= y + reach; v += spacing) {
          if (v >= first && v <= last) CountAgreeing(pixels, rows[v - first], spacing, piece_begin, piece_end, &counts);
        }
      });
      function(y, counts);
    }
  });
}

}  // namespace phi

#include "phi/inference/region_parts.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "phi/inference/connected_runs.h"

namespace phi {
namespace {

constexpr std::int32_t kOpen = -2;  // of a part, but not yet of which

// The cores that become parts: large enough, in an area that holds several of these.
std::vector<PixelRun> FindParts(const ConnectedRuns& areas, const Array2D<std::int32_t>& area_at, const ConnectedRuns& cores,
                                std::int64_t min_core_size) {
  std::vector<std::size_t> area_of_core(cores.sizes.size());
  for (const PixelRun& run : cores.runs) {
    area_of_core[static_cast<std::size_t>(run.label)] = static_cast<std::size_t>(area_at.data()[run.begin]);
  }
  std::vector<int> num_cores(areas.sizes.size(), 0);
  for (std::size_t core = 0; core < area_of_core.size(); ++core) {
    num_cores[area_of_core[core]] += cores.sizes[core] >= min_core_size;
  }
  std::vector<PixelRun> parts = cores.runs;
  std::erase_if(parts, [&](const PixelRun& run) {
    const auto core = static_cast<std::size_t>(run.label);
    return cores.sizes[core] < min_core_size || num_cores[area_of_core[core]] < 2;
  });
  return parts;
}

// Calls function(neighbor) for the four neighbours of pixel i that lie in the image.
template <class Function>
void ForNeighbors(std::int32_t i, int width, int height, const Function& function) {
  const int x = i % width, y = i / width;
  if (x > 0) function(i - 1);
  if (x + 1 < width) function(i + 1);
  if (y > 0) function(i - width);
  if (y + 1 < height) function(i + width);
}

// The pixels of parts that have open neighbours: a wall is not to be listed whole.
std::vector<std::int32_t> FindFront(const std::vector<PixelRun>& parts, const Array2D<std::int32_t>& part_at) {
  std::vector<std::int32_t> front;
  for (const PixelRun& part : parts) {
    for (std::int32_t i = part.begin; i < part.end; ++i) {
      bool is_front = false;
      ForNeighbors(i, part_at.width(), part_at.height(), [&](std::int32_t neighbor) { is_front |= part_at.data()[neighbor] == kOpen; });
      if (is_front) front.push_back(i);
    }
  }
  return front;
}

// Goes on from the pixels of `front` into open ones, a pixel a round.
void Spread(std::vector<std::int32_t> front, Array2D<std::int32_t>* part_at) {
  std::vector<std::int32_t> next;
  for (; !front.empty(); std::swap(front, next)) {
    next.clear();
    for (const std::int32_t i : front) {
      ForNeighbors(i, part_at->width(), part_at->height(), [&](std::int32_t neighbor) {
        if (part_at->data()[neighbor] != kOpen) return;
        part_at->data()[neighbor] = part_at->data()[i];
        next.push_back(neighbor);
      });
    }
  }
}

// Of the pixels of areas with parts the one that they go to; kInNoRun elsewhere.
Array2D<std::int32_t> NearestParts(const ConnectedRuns& areas, const Array2D<std::int32_t>& area_at, const std::vector<PixelRun>& parts) {
  std::vector<std::uint8_t> has_parts(areas.sizes.size(), 0);
  for (const PixelRun& part : parts) has_parts[static_cast<std::size_t>(area_at.data()[part.begin])] = 1;
  Array2D<std::int32_t> part_at(area_at.width(), area_at.height(), kInNoRun);
  const auto fill = [&](const PixelRun& run, std::int32_t value) {
    std::fill(part_at.data() + run.begin, part_at.data() + run.end, value);
  };
  for (const PixelRun& run : areas.runs) {
    if (has_parts[static_cast<std::size_t>(run.label)] != 0) fill(run, kOpen);
  }
  for (const PixelRun& part : parts) fill(part, part.label);
  Spread(FindFront(parts, part_at), &part_at);
  return part_at;
}

}  // namespace

ImageRegions PartAtNecks(const Mask& inside, const Mask& wide, std::int64_t min_core_size) {
  const ConnectedRuns areas = FindConnectedRuns(inside), cores = FindConnectedRuns(wide);
  Array2D<std::int32_t> region = LabelImage(areas, inside.width(), inside.height());
  const std::vector<PixelRun> parts = FindParts(areas, region, cores, min_core_size);
  if (parts.empty()) return {std::move(region), static_cast<std::int32_t>(areas.sizes.size())};
  const Array2D<std::int32_t> part_at = NearestParts(areas, region, parts);

  // numbered anew, by first pixels
  std::vector<std::int32_t> of_area(areas.sizes.size(), kInNoRun), of_part(cores.sizes.size(), kInNoRun);
  std::int32_t num_regions = 0;
  for (const PixelRun& run : areas.runs) {
    for (std::int32_t i = run.begin; i < run.end; ++i) {
      const std::int32_t part = part_at.data()[i];
      std::int32_t& number = part >= 0 ? of_part[static_cast<std::size_t>(part)] : of_area[static_cast<std::size_t>(run.label)];
      if (number == kInNoRun) number = num_regions++;
      region.data()[i] = number;
    }
  }
  return {std::move(region), num_regions};
}

}  // namespace phi

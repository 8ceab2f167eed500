#include "phi/inference/region_parts.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "phi/inference/connected_runs.h"

namespace phi {
namespace {

constexpr std::int32_t kOpen = -2;  // of a part, but not yet of which

struct Parts {
  std::vector<std::uint8_t> is_part;    // of each core, 1: it becomes one
  std::vector<std::uint8_t> has_parts;  // of each area, 1: it holds cores that do
  bool any = false;
};

// Cores become parts where they are large enough and their area holds several of these.
Parts FindParts(const ConnectedRuns& areas, const Array2D<std::int32_t>& area_at, const ConnectedRuns& cores,
                std::int64_t min_core_size) {
  std::vector<std::size_t> area_of_core(cores.sizes.size());
  for (const PixelRun& run : cores.runs) {
    area_of_core[static_cast<std::size_t>(run.label)] = static_cast<std::size_t>(area_at.data()[run.begin]);
  }
  std::vector<int> num_cores(areas.sizes.size(), 0);
  for (std::size_t core = 0; core < area_of_core.size(); ++core) {
    num_cores[area_of_core[core]] += cores.sizes[core] >= min_core_size;
  }
  Parts parts{std::vector<std::uint8_t>(area_of_core.size(), 0), std::vector<std::uint8_t>(num_cores.size(), 0)};
  for (std::size_t core = 0; core < area_of_core.size(); ++core) {
    if (cores.sizes[core] < min_core_size || num_cores[area_of_core[core]] < 2) continue;
    parts.is_part[core] = parts.has_parts[area_of_core[core]] = 1;
    parts.any = true;
  }
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

// The core's pixels that have open neighbours: a wall is not to be listed whole.
void AddFront(const PixelRun& core, const Array2D<std::int32_t>& core_at, std::vector<std::int32_t>* front) {
  for (std::int32_t i = core.begin; i < core.end; ++i) {
    bool is_front = false;
    ForNeighbors(i, core_at.width(), core_at.height(), [&](std::int32_t neighbor) { is_front |= core_at.data()[neighbor] == kOpen; });
    if (is_front) front->push_back(i);
  }
}

// Goes on from the pixels of `front` into open ones, a pixel a round.
void Spread(std::vector<std::int32_t> front, Array2D<std::int32_t>* core_at) {
  std::vector<std::int32_t> next;
  for (; !front.empty(); std::swap(front, next)) {
    next.clear();
    for (const std::int32_t i : front) {
      ForNeighbors(i, core_at->width(), core_at->height(), [&](std::int32_t neighbor) {
        if (core_at->data()[neighbor] != kOpen) return;
        core_at->data()[neighbor] = core_at->data()[i];
        next.push_back(neighbor);
      });
    }
  }
}

// Of the pixels of areas with parts the core that they go to; kInNoRun elsewhere.
Array2D<std::int32_t> NearestParts(const ConnectedRuns& areas, const ConnectedRuns& cores, const Parts& parts, int width, int height) {
  Array2D<std::int32_t> core_at(width, height, kInNoRun);
  const auto fill = [&](const PixelRun& run, std::int32_t value) {
    std::fill(core_at.data() + run.begin, core_at.data() + run.end, value);
  };
  for (const PixelRun& run : areas.runs) {
    if (parts.has_parts[static_cast<std::size_t>(run.label)] != 0) fill(run, kOpen);
  }
  const auto is_part = [&](const PixelRun& run) { return parts.is_part[static_cast<std::size_t>(run.label)] != 0; };
  for (const PixelRun& run : cores.runs) {
    if (is_part(run)) fill(run, run.label);
  }
  std::vector<std::int32_t> front;
  for (const PixelRun& run : cores.runs) {
    if (is_part(run)) AddFront(run, core_at, &front);
  }
  Spread(std::move(front), &core_at);
  return core_at;
}

}  // namespace

ImageRegions PartAtNecks(const Mask& inside, const Mask& wide, std::int64_t min_core_size) {
  const ConnectedRuns areas = FindConnectedRuns(inside), cores = FindConnectedRuns(wide);
  Array2D<std::int32_t> region = LabelImage(areas, inside.width(), inside.height());
  const Parts parts = FindParts(areas, region, cores, min_core_size);
  if (!parts.any) return {std::move(region), static_cast<std::int32_t>(areas.sizes.size())};
  const Array2D<std::int32_t> core_at = NearestParts(areas, cores, parts, inside.width(), inside.height());

  // numbered anew, by first pixels
  std::vector<std::int32_t> of_area(areas.sizes.size(), kInNoRun), of_core(cores.sizes.size(), kInNoRun);
  std::int32_t num_regions = 0;
  for (const PixelRun& run : areas.runs) {
    for (std::int32_t i = run.begin; i < run.end; ++i) {
      const std::int32_t core = core_at.data()[i];
      std::int32_t& number = core >= 0 ? of_core[static_cast<std::size_t>(core)] : of_area[static_cast<std::size_t>(run.label)];
      if (number == kInNoRun) number = num_regions++;
      region.data()[i] = number;
    }
  }
  return {std::move(region), num_regions};
}

}  // namespace phi

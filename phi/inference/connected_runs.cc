#include "phi/inference/connected_runs.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

constexpr int kBandRows = 64;  // searched by one thread

// The first pixel of `value` from `begin` to before `end`; end: there is none.
const std::uint8_t* FindValue(const std::uint8_t* begin, const std::uint8_t* end, std::uint8_t value) {
  const void* found = std::memchr(begin, value, static_cast<std::size_t>(end - begin));
  return found == nullptr ? end : static_cast<const std::uint8_t*>(found);
}

void AddRunsOfRow(const Mask& mask, int y, std::vector<PixelRun>* runs) {
  const std::uint8_t *origin = mask.data(), *row = &mask(0, y), *end = row + mask.width();
  for (const std::uint8_t* next = row; (next = FindValue(next, end, 255)) != end;) {
    const std::uint8_t* first = next;
    next = FindValue(first, end, 0);
    runs->push_back({static_cast<std::int32_t>(first - origin), static_cast<std::int32_t>(next - origin), kInNoRun});
  }
}

std::vector<PixelRun> FindRuns(const Mask& mask) {
  std::vector<std::vector<PixelRun>> bands(static_cast<std::size_t>((mask.height() + kBandRows - 1) / kBandRows));
  tbb::parallel_for(std::size_t{0}, bands.size(), [&](std::size_t band) {
    const int begin = static_cast<int>(band) * kBandRows, end = std::min(begin + kBandRows, mask.height());
    for (int y = begin; y < end; ++y) AddRunsOfRow(mask, y, &bands[band]);
  });
  std::vector<PixelRun> runs;
  for (const std::vector<PixelRun>& band : bands) runs.insert(runs.end(), band.begin(), band.end());
  return runs;
}

// Sets of runs, each by its first one.
class RunSets {
 public:
  explicit RunSets(std::size_t num_runs) : parents_(num_runs) {
    for (std::size_t i = 0; i < num_runs; ++i) parents_[i] = i;
  }

  std::size_t FirstOf(std::size_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }

  void Join(std::size_t i, std::size_t j) {
    i = FirstOf(i), j = FirstOf(j);
    parents_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<std::size_t> parents_;
};

}  // namespace

ConnectedRuns FindConnectedRuns(const Mask& mask) {
  const std::int32_t width = mask.width();
  ConnectedRuns connected{FindRuns(mask), {}};
  std::vector<PixelRun>& runs = connected.runs;
  RunSets sets(runs.size());
  std::size_t above = 0;  // the first run that ends behind the place above the next one's begin
  for (std::size_t i = 0; i < runs.size(); ++i) {
    while (runs[above].end <= runs[i].begin - width) ++above;
    for (std::size_t j = above; runs[j].begin < runs[i].end - width; ++j) sets.Join(i, j);
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::size_t first = sets.FirstOf(i);
    if (first == i) {
      runs[i].label = static_cast<std::int32_t>(connected.sizes.size());
      connected.sizes.push_back(0);
    }
    runs[i].label = runs[first].label;
    connected.sizes[static_cast<std::size_t>(runs[i].label)] += runs[i].end - runs[i].begin;
  }
  return connected;
}

Array2D<std::int32_t> LabelImage(const ConnectedRuns& connected, int width, int height) {
  Array2D<std::int32_t> labels(width, height, kInNoRun);
  tbb::parallel_for(std::size_t{0}, connected.runs.size(), [&](std::size_t i) {
    const PixelRun& run = connected.runs[i];
    std::fill(labels.data() + run.begin, labels.data() + run.end, run.label);
  });
  return labels;
}

}  // namespace phi

#include "phi/cpu/cpu_filter.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "phi/base/cancellation.h"
#include "phi/filtering/filter_setup.h"

namespace phi {

PlaneMap FilterOnCpu(const FilterInput& input, const FilterOptions& options) {
  const FilterReference reference = MakeFilterReference(input, options);
  const std::vector<SourceMap> sources = SourcesWithMap(input);
  Mask keep(reference.map.width, reference.map.height);
  const std::size_t num_turns = std::max<std::size_t>(sources.size(), 1);
  for (std::size_t j = 0; j < num_turns; ++j) {
    FilterTurn turn{.is_last = j + 1 == num_turns};
    std::shared_ptr<const PlaneMap> map;
    FilterSource source;
    if (j < sources.size()) {
      map = sources[j].load();
      source = {MakeRelativeView(input.reference.view->camera, sources[j].view->camera), map->view()};
      turn.sources = &source;
      turn.num_sources = 1;
    }
    tbb::parallel_for(0, keep.height(), [&](int y) {
      ThrowIfCancelled();
      for (int x = 0; x < keep.width(); ++x) keep(x, y) = FilterPixel(reference, turn, x, y, keep(x, y));
    });
  }
  return KeptPixels(*input.reference.map, keep.data());
}

}  // namespace phi

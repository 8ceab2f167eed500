#include "phi/cpu/cpu_filter.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "phi/base/cancellation.h"
#include "phi/filtering/filter_setup.h"

namespace phi {

MeasurementMap FilterOnCpu(const FilterInput& input, const FilterOptions& options) {
  const FilterReference reference = MakeFilterReference(input, options);
  const std::vector<SourceMap> sources = SourcesWithMap(input);
  Array2D<FilterState> states(reference.map.width, reference.map.height);
  for (const SourceMap& view : sources) {
    const std::shared_ptr<const MeasurementMap> map = view.load();
    FilterSource source{MakeRelativeView(input.reference.view->camera, view.view->camera),
                        map->planes.view()};
    const std::shared_ptr<const Mask> mask = view.load_mask ? view.load_mask() : nullptr;
    if (mask != nullptr) source.mask = mask->view();
    const FilterTurn turn{&source, 1};
    tbb::parallel_for(0, states.height(), [&](int y) {
      ThrowIfCancelled();
      for (int x = 0; x < states.width(); ++x) AskSources(reference, turn, x, y, &states(x, y));
    });
  }
  auto verdicts = Array2D<FilterVerdict>::Uninitialized(states.width(), states.height());
  tbb::parallel_for(0, states.height(), [&](int y) {
    for (int x = 0; x < states.width(); ++x) verdicts(x, y) = JudgeByViews(reference, x, y, states(x, y));
  });
  return KeptPixels(*input.reference.map, verdicts.data());
}

}  // namespace phi

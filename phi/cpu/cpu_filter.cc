#include "phi/cpu/cpu_filter.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "phi/base/cancellation.h"
#include "phi/base/wide_vectors.h"
#include "phi/filtering/filter_setup.h"

namespace phi {
namespace {

// Not for vectors: with AVX2 floorf is an instruction, without it a call. So all that a pixel does has to be inlined here.
PHI_WIDE_VECTORS __attribute__((flatten)) void AskForRow(const FilterReference& reference, const FilterTurn& turn, int y,
                                                         Testimonies* testimonies) {
  for (int x = 0; x < reference.map.width; ++x) AskSources(reference, turn, x, y, &testimonies[x]);
}

}  // namespace

MeasurementMap FilterOnCpu(const FilterInput& input, const FilterOptions& options) {
  const FilterReference reference = MakeFilterReference(input, options);
  const std::vector<SourceMap> sources = SourcesWithMap(input);
  Array2D<Testimonies> testimonies(reference.map.width, reference.map.height);
  for (const SourceMap& view : sources) {
    const std::shared_ptr<const MeasurementMap> map = view.load();
    FilterSource source{MakeRelativeView(input.reference.view->camera, view.view->camera),
                        map->planes.view()};
    const std::shared_ptr<const ImageMask> mask = view.load_mask ? view.load_mask() : nullptr;
    if (mask != nullptr) source.mask = mask->view();
    const FilterTurn turn{&source, 1};
    tbb::parallel_for(0, testimonies.height(), [&](int y) {
      ThrowIfCancelled();
      AskForRow(reference, turn, y, &testimonies(0, y));
    });
  }
  auto verdicts = Array2D<FilterVerdict>::Uninitialized(testimonies.width(), testimonies.height());
  tbb::parallel_for(0, testimonies.height(), [&](int y) {
    for (int x = 0; x < testimonies.width(); ++x) verdicts(x, y) = JudgeByViews(reference, x, y, testimonies(x, y));
  });
  return KeptPixels(*input.reference.map, verdicts.data(), testimonies.data());
}

}  // namespace phi

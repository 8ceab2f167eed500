#include "phi/cpu/cpu_filter.h"

#include <tbb/parallel_for.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "phi/base/cancellation.h"
#include "phi/base/wide_vectors.h"
#include "phi/filtering/filter_setup.h"
#include "phi/filtering/judge_measurements.h"

namespace phi {
namespace {

// Pixels of a row that a source is asked about, side by side: what each says, and what becomes of it.
struct AskedPixels {
  static constexpr int kMost = 64;
  using Floats = float[kMost];

  int size = 0;
  int x[kMost];
  Floats u, depth, normal_x, normal_y, normal_z, max_error;
  Floats point_x, point_y, point_z, source_u, source_v;  // in the source's frame and image
  Floats nearest, d00, d10, d01, d11, fx, fy, map_x, map_y, map_z;  // MapTaps
  std::int32_t faces_view[kMost], agreement[kMost];
};

// What follows is phi::Ask in four loops, of which two become vector instructions: the same bits. By value what these read, so that the
// compiler sees that nothing in them changes. With AVX2 floorf is an instruction, without it a call: so all is inlined.
#define PHI_FLAT PHI_WIDE_VECTORS __attribute__((flatten))

PHI_FLAT void Project(const RayModel reference, const FilterSource source, const ConsistencyThresholds thresholds, float v,
                      AskedPixels* __restrict a) {
  for (int i = 0; i < a->size; ++i) {
    const ProjectedPoint point = ProjectHypothesis(reference, {a->u[i], v}, a->depth[i], source.view);
    a->faces_view[i] = FacesView(source, {a->normal_x[i], a->normal_y[i], a->normal_z[i]}, point, thresholds);
    a->point_x[i] = point.in_source.x, a->point_y[i] = point.in_source.y, a->point_z[i] = point.in_source.z;
    a->source_u[i] = point.at_source.u, a->source_v[i] = point.at_source.v;
  }
}

PHI_FLAT void Read(const ArrayView2D<const PlaneHypothesis> map, AskedPixels* __restrict a) {
  for (int i = 0; i < a->size; ++i) {
    const MapTaps taps = ReadTaps(map, a->source_u[i], a->source_v[i]);
    a->nearest[i] = taps.nearest, a->d00[i] = taps.d00, a->d10[i] = taps.d10, a->d01[i] = taps.d01, a->d11[i] = taps.d11;
    a->fx[i] = taps.fx, a->fy[i] = taps.fy;
    a->map_x[i] = taps.normal.x, a->map_y[i] = taps.normal.y, a->map_z[i] = taps.normal.z;
  }
}

PHI_FLAT void Compare(const RayModel reference, const RelativeView view, ConsistencyThresholds thresholds, float v,
                      AskedPixels* __restrict a) {
  for (int i = 0; i < a->size; ++i) {
    const ImagePoint at = {a->u[i], v};
    const ProjectedPoint point = {a->depth[i] * reference.Ray(at.u, at.v), {a->point_x[i], a->point_y[i], a->point_z[i]}, at,
                                  {a->source_u[i], a->source_v[i]}};
    const MapTaps taps = {a->nearest[i], {a->map_x[i], a->map_y[i], a->map_z[i]}, a->d00[i], a->d10[i], a->d01[i], a->d11[i],
                          a->fx[i], a->fy[i]};
    thresholds.max_reprojection_error = a->max_error[i];
    const Vec3f normal = {a->normal_x[i], a->normal_y[i], a->normal_z[i]};
    a->agreement[i] = static_cast<std::int32_t>(CompareWithMap(reference, view, normal, point, taps, thresholds));
  }
}

void Add(const FilterReference& reference, int x, int y, AskedPixels* asked) {
  const PlaneHypothesis& h = reference.map(x, y);
  const int i = asked->size++;
  asked->x[i] = x, asked->u[i] = x + 0.5f, asked->depth[i] = h.depth;
  asked->normal_x[i] = h.normal.x, asked->normal_y[i] = h.normal.y, asked->normal_z[i] = h.normal.z;
  asked->max_error[i] = MaxReprojectionError(reference, x, y);
}

PHI_FLAT void CountAnswers(const FilterSource& source, const AskedPixels& a, float gap, Testimonies* row) {
  for (int i = 0; i < a.size; ++i) {
    ProjectedPoint point;
    point.in_source.z = a.point_z[i];
    point.at_source = {a.source_u[i], a.source_v[i]};
    Count(TestimonyOf(source, point, static_cast<Agreement>(a.agreement[i]), a.faces_view[i] != 0, gap), &row[a.x[i]]);
  }
}

void AskAll(const FilterReference& reference, const FilterSource& source, int y, AskedPixels* asked, Testimonies* row) {
  const ConsistencyThresholds& thresholds = reference.thresholds;
  Project(reference.rays, source, thresholds, y + 0.5f, asked);
  Read(source.map, asked);
  Compare(reference.rays, source.view, thresholds, y + 0.5f, asked);
  CountAnswers(source, *asked, thresholds.depth_gap, row);
  asked->size = 0;
}

// AskSources of all pixels of row y, one source.
void AskForRow(const FilterReference& reference, const FilterSource& source, int y, Testimonies* row) {
  AskedPixels asked;
  for (int x = 0; x < reference.map.width; ++x) {
    if (AsksOn(reference, x, y, row[x])) Add(reference, x, y, &asked);
    if (asked.size == AskedPixels::kMost) AskAll(reference, source, y, &asked, row);
  }
  AskAll(reference, source, y, &asked, row);
}

}  // namespace

MeasurementMap FilterOnCpu(const FilterInput& input, const FilterOptions& options, Array2D<Testimonies>* said) {
  const FilterReference reference = MakeFilterReference(input, options);
  const std::vector<SourceMap> sources = SourcesWithMap(input);
  Array2D<Testimonies> testimonies(reference.map.width, reference.map.height);
  for (const SourceMap& view : sources) {
    const std::shared_ptr<const MeasurementMap> map = view.load();
    FilterSource source{MakeRelativeView(input.reference.view->camera, view.view->camera),
                        map->planes.view()};
    const std::shared_ptr<const ImageMask> mask = view.load_mask ? view.load_mask() : nullptr;
    if (mask != nullptr) source.mask = mask->view();
    tbb::parallel_for(0, testimonies.height(), [&](int y) {
      ThrowIfCancelled();
      AskForRow(reference, source, y, &testimonies(0, y));
    });
  }
  auto verdicts = Array2D<FilterVerdict>::Uninitialized(testimonies.width(), testimonies.height());
  tbb::parallel_for(0, testimonies.height(), [&](int y) {
    for (int x = 0; x < testimonies.width(); ++x) verdicts(x, y) = JudgeByViews(reference, x, y, testimonies(x, y));
  });
  MeasurementMap kept = KeptPixels(*input.reference.map, verdicts.data());
  if (input.judgement) JudgeMeasurements(*input.judgement, input.reference.map->planes, testimonies, &kept);
  if (said != nullptr) *said = std::move(testimonies);
  return kept;
}

}  // namespace phi

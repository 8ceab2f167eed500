#include "phi/cpu/cpu_sharing.h"

#include <atomic>
#include <cstdint>
#include <memory>

#include "phi/cpu/cpu_context.h"
#include "phi/matching/estimation_setup.h"
#include "phi/matching/share_pixel.h"

namespace phi {
namespace {

void KeepNearest(NearestPixel found, NearestPixel* kept) {
  const std::atomic_ref<NearestPixel> shared(*kept);
  NearestPixel before = shared.load(std::memory_order_relaxed);
  while (found < before && !shared.compare_exchange_weak(before, found, std::memory_order_relaxed)) {
  }
}

// Of reference pixels that are settled nobody looks at what is found.
Array2D<NearestPixel> FindNearest(const EstimationParameters& p, const OfferingSource& source,
                                  const OffersView& offers) {
  Array2D<NearestPixel> nearest(p.reference.width, p.reference.height, kNoPixel);
  ForEachRow(source.planes.height, [&](int y) {
    FallenPixel fallen;
    for (int x = 0; x < source.planes.width; ++x) {
      if (!FallOnReference(source, p.reference, x, y, &fallen) || offers.IsSettled(fallen.x, fallen.y))
        continue;
      const auto number = static_cast<std::uint32_t>(y * source.planes.width + x);
      KeepNearest(PackNearest(fallen.depth, number), &nearest(fallen.x, fallen.y));
    }
  });
  return nearest;
}

}  // namespace

PlaneMap OfferedPlanes(const EstimationParameters& parameters, const ViewMap& own,
                       const std::vector<SourceMap>& sources) {
  const PlaneMap& planes = own.map->planes;
  PlaneMap offered(planes.width(), planes.height());
  Array2D<std::uint8_t> leads(planes.width(), planes.height());
  const OffersView offers{planes.view(), offered.view(), leads.view()};
  for (const SourceMap& source : sources) {
    const std::shared_ptr<const MeasurementMap> map = source.load();
    const Camera& camera = source.view->camera;
    const OfferingSource offering{MakeRelativeView(camera, own.view->camera), MakeRayModel(camera.pinhole),
                                  map->planes.view()};
    const Array2D<NearestPixel> nearest = FindNearest(parameters, offering, offers);
    ForEachRow(planes.height(), [&](int y) {
      for (int x = 0; x < planes.width(); ++x) HearOffer(parameters, offering, nearest(x, y), offers, x, y);
    });
  }
  return offered;
}

PlaneMap ShareOnCpu(const SharingInput& input, const StereoOptions& options) {
  const EstimationInput& estimation = input.estimation;
  const EstimationParameters parameters = MakeEstimationParameters(estimation, options);
  PlaneMap planes = OfferedPlanes(parameters, input.own, input.sources);
  const SimdMatcher matcher(estimation, parameters, MakeRelativeViews(estimation));
  const CpuContext context{parameters, {}, matcher};
  const OffersView offers{input.own.map->planes.view(), planes.view(), {}};
  ForEachRow(planes.height(), [&](int y) {
    for (int x = 0; x < planes.width(); ++x) ChoosePlane(context, offers, x, y);
  });
  return planes;
}

}  // namespace phi

#include "phi/matching/shared_hypotheses.h"

#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/base/cancellation.h"
#include "phi/matching/estimation_setup.h"

namespace phi {
namespace {

constexpr float kOwnPlane = 0.005f, kSamePlane = 0.01f;  // relative differences of depth
// Of depth, from where a source's pixel meets its plane to the reference pixel's centre.
constexpr float kMaxShift = 0.05f;
constexpr float kMargin = 0.03f;  // of the matching cost

bool AreClose(float depth, float other, float difference) { return std::abs(depth / other - 1) < difference; }

// The nearest of a source's pixels on each reference pixel: its depth's bits above, which order as positive floats do, and its number below.
using Nearest = std::uint64_t;
constexpr Nearest kNothing = ~Nearest{0};

Nearest Pack(float depth, std::uint32_t number) {
  return Nearest{std::bit_cast<std::uint32_t>(depth)} << 32 | number;
}

void KeepNearest(Nearest found, Nearest* kept) {
  const std::atomic_ref<Nearest> shared(*kept);
  Nearest before = shared.load(std::memory_order_relaxed);
  while (found < before && !shared.compare_exchange_weak(before, found, std::memory_order_relaxed)) {
  }
}

class SourcePlanes {
 public:
  // `view`: takes the source's pixels to the reference.
  SourcePlanes(const EstimationParameters& parameters, const RelativeView& view, const PlaneMap& planes,
               const RayModel& source)
      : parameters_(parameters), view_(view), planes_(planes), source_(source) {}

  // Of reference pixels that are settled nobody looks at what is found.
  template <typename IsSettled>
  Array2D<Nearest> FindNearest(const IsSettled& is_settled) const {
    const int width = parameters_.reference.width, height = parameters_.reference.height;
    Array2D<Nearest> nearest(width, height, kNothing);
    tbb::parallel_for(0, planes_.height(), [&](int y) {
      ThrowIfCancelled();
      const float v = y + 0.5f;
      const float* a = view_.a.m;
      for (int x = 0; x < planes_.width(); ++x) {
        const float u = x + 0.5f, depth = planes_(x, y).depth;
        const float z = depth * (a[6] * u + a[7] * v + a[8]) + view_.b.z;
        const float of_z = 1 / z;
        const float at_u = (depth * (a[0] * u + a[1] * v + a[2]) + view_.b.x) * of_z;
        const float at_v = (depth * (a[3] * u + a[4] * v + a[5]) + view_.b.y) * of_z;
        const bool is_inside =
            at_u >= 0 && at_v >= 0 && at_u < static_cast<float>(width) && at_v < static_cast<float>(height);
        if (!(depth > 0 && z > 0 && is_inside)) continue;
        const int x_met = static_cast<int>(at_u), y_met = static_cast<int>(at_v);
        if (!is_settled(x_met, y_met)) KeepNearest(Pack(z, Number(x, y)), &nearest(x_met, y_met));
      }
    });
    return nearest;
  }

  // The plane of source pixel `number` as it meets the ray through the centre of reference pixel (x, y); false where it does not near it.
  bool Meet(std::uint32_t number, int x, int y, PlaneHypothesis* met) const {
    const auto width = static_cast<std::uint32_t>(planes_.width());
    const float u = static_cast<float>(number % width) + 0.5f, v = static_cast<float>(number / width) + 0.5f;
    const PlaneHypothesis& plane = planes_.data()[number];
    const Vec3f point = view_.rotation * (plane.depth * source_.Ray(u, v)) + view_.translation;
    const Vec3f normal = view_.rotation * plane.normal, ray = parameters_.reference.Ray(x + 0.5f, y + 0.5f);
    if (!FacesCamera(normal, ray)) return false;
    *met = {normal, Dot(normal, point) / Dot(normal, ray)};
    return parameters_.IsInRange(met->depth) && AreClose(met->depth, point.z, kMaxShift);
  }

 private:
  std::uint32_t Number(int x, int y) const { return static_cast<std::uint32_t>(y * planes_.width() + x); }

  const EstimationParameters& parameters_;
  const RelativeView view_;
  const PlaneMap& planes_;
  const RayModel source_;
};

// What a pixel is offered so far, and by how many more sources than offer another plane (Boyer and Moore's majority vote).
struct Offer {
  // A source carries the pixel's own plane: nothing is offered any more.
  static constexpr std::uint8_t kConfirmed = 0xFF;

  PlaneHypothesis& plane;
  std::uint8_t& lead;

  void Vote(const PlaneHypothesis& found, float own_depth) {
    if (AreClose(found.depth, own_depth, kOwnPlane)) {
      plane = {};
      lead = kConfirmed;
    } else if (!(plane.depth > 0)) {
      plane = found;
      lead = 1;
    } else if (AreClose(found.depth, plane.depth, kSamePlane)) {
      ++lead;
    } else if (lead == 0) {
      plane = found;
      lead = 1;
    } else {
      --lead;
    }
  }
};

// The planes of `map` where something is offered.
PlaneMap Where(const PlaneMap& offered, const PlaneMap& map) {
  PlaneMap result(map.width(), map.height());
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (offered.data()[i].depth > 0) result.data()[i] = map.data()[i];
  }
  return result;
}

}  // namespace

PlaneMap OfferedPlanes(const EstimationParameters& parameters, const ViewMap& own,
                       const std::vector<SourceMap>& sources) {
  const PlaneMap& planes = own.map->planes;
  PlaneMap offered(planes.width(), planes.height());
  Array2D<std::uint8_t> leads(planes.width(), planes.height());
  const auto is_settled = [&](int x, int y) {
    return leads(x, y) == Offer::kConfirmed || !(planes(x, y).depth > 0);
  };
  for (const SourceMap& source : sources) {
    if (source.load == nullptr) continue;
    const std::shared_ptr<const MeasurementMap> map = source.load();
    const Camera& camera = source.view->camera;
    const SourcePlanes of_source(parameters, MakeRelativeView(camera, own.view->camera), map->planes,
                                 MakeRayModel(camera.pinhole));
    const Array2D<Nearest> nearest = of_source.FindNearest(is_settled);
    tbb::parallel_for(0, planes.height(), [&](int y) {
      PlaneHypothesis met;
      for (int x = 0; x < planes.width(); ++x) {
        if (nearest(x, y) == kNothing) continue;
        if (!of_source.Meet(static_cast<std::uint32_t>(nearest(x, y)), x, y, &met)) continue;
        Offer{offered(x, y), leads(x, y)}.Vote(met, planes(x, y).depth);
      }
    });
  }
  return offered;
}

PlaneMap ShareHypotheses(Backend& backend, EstimationInput input, const StereoOptions& options,
                         const ViewMap& own, const std::vector<SourceMap>& sources) {
  PlaneMap shared = own.map->planes;
  const auto offered =
      std::make_shared<const PlaneMap>(OfferedPlanes(MakeEstimationParameters(input, options), own, sources));
  input.initial = std::make_shared<const PlaneMap>(Where(*offered, shared));
  const CostMap own_cost = backend.MatchingCosts(input, options);
  input.initial = offered;
  const CostMap cost = backend.MatchingCosts(input, options);
  for (std::size_t i = 0; i < shared.size(); ++i) {
    const PlaneHypothesis& plane = offered->data()[i];
    if (plane.depth > 0 && cost.data()[i] < own_cost.data()[i] - kMargin) shared.data()[i] = plane;
  }
  return shared;
}

}  // namespace phi

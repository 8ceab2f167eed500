#include "phi/inference/pooled_supports.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/base/random.h"
#include "phi/geometry/device_camera.h"
#include "phi/matching/cost_aggregation.h"

namespace phi {
namespace {

// Grey levels. A point that is hidden in the reference image lands on what hides it, which mostly has another
// brightness; an even surface keeps its own but for noise, a slight gloss and the exposure, which differ by a few levels.
// Where exposures differ more, the view adds little, and the reference's own supports carry the planes as without it.
constexpr int kMaxBrightnessChange = 6;
// Neighbours tell a plane nothing new, and all source views together still outnumber the reference's own supports.
constexpr int kMinStep = 2;

int SamplingStep(int width, int height) {
  const auto num_sampled = [&](std::int64_t step) {
    return ((width + step - 1) / step) * ((height + step - 1) / step);
  };
  int step = kMinStep;
  while (num_sampled(step) > kMaxPooledPerView) ++step;
  return step;
}

class SourcePool {
 public:
  SourcePool(const InferenceInput& input, const ViewImage& source, const DepthMap& depths)
      : measured_(*input.measured),
        reference_image_(*input.reference.image),
        source_image_(*source.image),
        depths_(depths),
        step_(SamplingStep(depths.width(), depths.height())),
        source_id_(source.view->image_id),
        source_rays_(MakeRayModel(source.view->camera.pinhole)),
        reference_from_source_(MakeRelativeView(source.view->camera, input.reference.view->camera)) {}

  int NumRows() const { return (depths_.height() + step_ - 1) / step_; }

  // Sampled row `row`.
  std::vector<PooledSupport> Row(int row) const {
    std::vector<PooledSupport> supports;
    for (int x = 0; x < depths_.width(); x += step_) AddPixel(x, row * step_, &supports);
    supports.shrink_to_fit();  // all rows wait for each other
    return supports;
  }

 private:
  void AddPixel(int x, int y, std::vector<PooledSupport>* row) const {
    const float depth = depths_(x, y);
    if (!(depth > 0)) return;
    const RelativeView& view = reference_from_source_;
    const Vec3f point = view.rotation * (depth * source_rays_.Ray(static_cast<float>(x) + 0.5f,
                                                                  static_cast<float>(y) + 0.5f)) +
                        view.translation;
    if (!(point.z > 0)) return;
    const float u = view.source.fx * point.x / point.z + view.source.cx;
    const float v = view.source.fy * point.y / point.z + view.source.cy;
    const int width = measured_.width(), height = measured_.height();
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(width) && v < static_cast<float>(height))) return;
    const PooledSupport support{u - 0.5f, v - 0.5f, 1 / point.z, Hash(x, y)};
    // The reference's own measurement knows better what is there.
    if (measured_(support.PixelX(), support.PixelY()).depth > 0) return;
    const int change = reference_image_(support.PixelX(), support.PixelY()) - source_image_(x, y);
    if (std::abs(change) <= kMaxBrightnessChange) row->push_back(support);
  }

  std::uint32_t Hash(int x, int y) const {
    return Philox({0, source_id_}, static_cast<std::uint64_t>(y) * depths_.width() + x, 0, 0).v[0];
  }

  const PlaneMap& measured_;
  const GrayImage& reference_image_;
  const GrayImage& source_image_;
  const DepthMap& depths_;
  int step_;
  std::uint32_t source_id_;
  RayModel source_rays_;
  RelativeView reference_from_source_;
};

}  // namespace

std::vector<PooledSupport> PoolSupports(const InferenceInput& input) {
  std::vector<SourcePool> sources;
  std::vector<std::pair<std::size_t, int>> rows;  // of sources
  const std::size_t num_views =
      std::min<std::size_t>({input.sources.size(), input.source_depths.size(), kMaxSourceViews});
  for (std::size_t j = 0; j < num_views; ++j) {
    if (input.source_depths[j] == nullptr) continue;
    sources.emplace_back(input, input.sources[j], *input.source_depths[j]);
    for (int row = 0; row < sources.back().NumRows(); ++row) rows.emplace_back(sources.size() - 1, row);
  }
  std::vector<std::vector<PooledSupport>> supports(rows.size());
  tbb::parallel_for(std::size_t{0}, rows.size(),
                    [&](std::size_t i) { supports[i] = sources[rows[i].first].Row(rows[i].second); });
  std::size_t num_supports = 0;
  for (const auto& row : supports) num_supports += row.size();
  std::vector<PooledSupport> pooled;
  pooled.reserve(num_supports);
  for (auto& row : supports) {
    pooled.insert(pooled.end(), row.begin(), row.end());
    row = {};
  }
  return pooled;
}

}  // namespace phi

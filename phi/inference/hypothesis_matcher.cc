#include "phi/inference/hypothesis_matcher.h"

#include <algorithm>

#include "phi/base/wide_vectors.h"
#include "phi/matching/matching_window.h"

namespace phi {
namespace {

constexpr int kLanes = 8;  // independent partial sums, so that the compiler may use vector registers

}  // namespace

HypothesisMatcher::HypothesisMatcher(const InferenceInput& input, const Hypotheses& hypotheses,
                                     const StereoOptions& stereo, const Method& method)
    : reference_{input.reference.image->view()}, state_(hypotheses.state()) {
  const std::size_t num_views = input.NumMatched();
  for (std::size_t j = 0; j < num_views; ++j) {
    sources_.push_back({input.sources[j].image->view()});
    views_.push_back(MakeRelativeView(input.reference.view->camera, input.sources[j].view->camera));
    const bool has_depths = j < input.source_depths.size() && input.source_depths[j] != nullptr;
    source_depths_.push_back(has_depths ? input.source_depths[j]->view() : MeasuredDepthsView{});
  }
  parameters_ = {.reference = MakeRayModel(input.reference.view->camera.pinhole),
                 .window = MakeMatchingWindow(stereo),
                 .num_views = static_cast<int>(num_views),
                 .formulas = method.formulas,
                 .rules = method.rules};
  const int n = parameters_.window.samples_per_side;
  for (int row = -n; row <= n; ++row) {
    for (int column = -n; column <= n; ++column) {
      offset_u_.push_back(column * parameters_.window.step);
      offset_v_.push_back(row * parameters_.window.step);
    }
  }
  // Padding repeats the window's centre; ViewCost leaves it out of the sums.
  const std::size_t padded = (offset_u_.size() + kLanes - 1) / kLanes * kLanes;
  offset_u_.resize(padded, 0.0f);
  offset_v_.resize(padded, 0.0f);
}

void HypothesisMatcher::SampleReference(int x, int y, Scratch* scratch) const {
  const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
  const float center = reference_(u, v);
  scratch->reference.resize(offset_u_.size());
  scratch->u.resize(offset_u_.size());
  scratch->v.resize(offset_u_.size());
  scratch->source.resize(offset_u_.size());
  for (std::size_t i = 0; i < offset_u_.size(); ++i) {
    scratch->reference[i] = reference_(u + offset_u_[i], v + offset_v_[i]) - center;
  }
}

PHI_WIDE_VECTORS void HypothesisMatcher::SampleMap(ArrayView2D<const float> inverse_depth, int x, int y,
                                                   Scratch* scratch) const {
  const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
  const float center = inverse_depth(x, y);
  scratch->inverse_depth.resize(offset_u_.size());
  for (std::size_t i = 0; i < offset_u_.size(); ++i) {
    scratch->inverse_depth[i] = SampleInverseDepth(inverse_depth, u + offset_u_[i], v + offset_v_[i], center);
  }
}

// Writes the samples' source coordinates, as array coordinates; false when one falls outside.
PHI_WIDE_VECTORS bool HypothesisMatcher::ProjectWindow(const RelativeView& view, int x, int y, Scratch* scratch) const {
  const Vec3f center = view.a * Vec3f{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f};
  const float* a = view.a.m;
  const float max_x = static_cast<float>(view.source.width - 1),
              max_y = static_cast<float>(view.source.height - 1);
  const float* w = scratch->inverse_depth.data();
  const float *du = offset_u_.data(), *dv = offset_v_.data();
  float *su = scratch->u.data(), *sv = scratch->v.data();
  int outside = 0;
  const int n = static_cast<int>(offset_u_.size());
  for (int i = 0; i < n; ++i) {
    const float px = center.x + a[0] * du[i] + a[1] * dv[i] + w[i] * view.b.x;
    const float py = center.y + a[3] * du[i] + a[4] * dv[i] + w[i] * view.b.y;
    const float pz = center.z + a[6] * du[i] + a[7] * dv[i] + w[i] * view.b.z;
    const float inverse = 1.0f / pz;
    const float qx = px * inverse - 0.5f, qy = py * inverse - 0.5f;
    outside |= !(pz > 0) | !(qx >= 0) | !(qy >= 0) | !(qx <= max_x) | !(qy <= max_y);
    su[i] = qx;
    sv[i] = qy;
  }
  return outside == 0;
}

PHI_WIDE_VECTORS float HypothesisMatcher::ViewCost(int view, int x, int y, Scratch* scratch) const {
  if (!ProjectWindow(views_[view], x, y, scratch)) return kMaxCost;
  const GraySampler& source = sources_[view];
  const int n = parameters_.window.NumSamples();
  float* samples = scratch->source.data();
  const float shift = source(scratch->u[n / 2] + 0.5f, scratch->v[n / 2] + 0.5f);
  for (int i = 0; i < n; ++i) {
    const float sx = scratch->u[i], sy = scratch->v[i];
    const int x0 = std::min(static_cast<int>(sx), source.image.width - 2);
    const int y0 = std::min(static_cast<int>(sy), source.image.height - 2);
    const float fx = sx - x0, fy = sy - y0;
    const std::uint8_t* p = &source.image(x0, y0);
    const float top = p[0] + fx * (p[1] - p[0]);
    const float bottom = p[source.image.width] + fx * (p[source.image.width + 1] - p[source.image.width]);
    samples[i] = top + fy * (bottom - top) - shift;
  }
  const int padded = static_cast<int>(offset_u_.size());
  float* reference = scratch->reference.data();
  for (int i = n; i < padded; ++i) reference[i] = samples[i] = 0;
  float r[kLanes] = {}, rr[kLanes] = {}, s[kLanes] = {}, ss[kLanes] = {}, rs[kLanes] = {};
  for (int i = 0; i < padded; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const float a = reference[i + lane], b = samples[i + lane];
      r[lane] += a;
      rr[lane] += a * a;
      s[lane] += b;
      ss[lane] += b * b;
      rs[lane] += a * b;
    }
  }
  ZnccSums sums;
  for (int lane = 0; lane < kLanes; ++lane) {
    sums.r += r[lane];
    sums.rr += rr[lane];
    sums.s += s[lane];
    sums.ss += ss[lane];
    sums.rs += rs[lane];
  }
  return sums.Cost(static_cast<float>(n));
}

}  // namespace phi

#include "phi/inference/hypothesis_matcher.h"

#include <algorithm>

#include "phi/base/wide_vectors.h"
#include "phi/inference/infer_setup.h"

namespace phi {
namespace {

constexpr int kLanes = 8;  // independent partial sums, so that the compiler may use vector registers

// Offsets du, dv from the window's centre, which is `center` in the source but for its inverse depth, and inverse depths w of n
// samples. Writes the samples' array coordinates in the source image; returns whether all lie in it. A function of its own, so that the compiler sees that no array changes
// another.
PHI_WIDE_VECTORS bool ProjectSamples(const RelativeView view, Vec3f center, int n, const float* __restrict du,
                                     const float* __restrict dv, const float* __restrict w, float* __restrict su,
                                     float* __restrict sv) {
  const float* const a = view.a.m;
  const float max_x = static_cast<float>(view.source.width - 1), max_y = static_cast<float>(view.source.height - 1);
  int is_inside = 1;
  for (int i = 0; i < n; ++i) {
    const float px = center.x + a[0] * du[i] + a[1] * dv[i] + w[i] * view.b.x;
    const float py = center.y + a[3] * du[i] + a[4] * dv[i] + w[i] * view.b.y;
    const float pz = center.z + a[6] * du[i] + a[7] * dv[i] + w[i] * view.b.z;
    const float inverse = 1.0f / pz;
    const float qx = px * inverse - 0.5f, qy = py * inverse - 0.5f;
    is_inside &= (pz > 0) & (qx >= 0) & (qy >= 0) & (qx <= max_x) & (qy <= max_y);
    su[i] = qx;
    sv[i] = qy;
  }
  return is_inside != 0;
}

// The samples around (u, v) as array coordinates, clamped to the border.
PHI_WIDE_VECTORS void PlaceSamples(float u, float v, int width, int height, int n, const float* __restrict du,
                                   const float* __restrict dv, float* __restrict su, float* __restrict sv) {
  const float max_x = static_cast<float>(width - 1), max_y = static_cast<float>(height - 1);
  for (int i = 0; i < n; ++i) {
    su[i] = Clamp(u + du[i] - 0.5f, 0.0f, max_x);
    sv[i] = Clamp(v + dv[i] - 0.5f, 0.0f, max_y);
  }
}

// SampleInverseDepth of each sample around (u, v).
PHI_WIDE_VECTORS void SampleInverseDepths(const ArrayView2D<const float> map, float u, float v, float center, int n,
                                          const float* __restrict du, const float* __restrict dv,
                                          float* __restrict samples) {
  for (int i = 0; i < n; ++i) samples[i] = SampleInverseDepth(map, u + du[i], v + dv[i], center);
}

// Of each sample the pixel above and left of it, as the place in an image's rows, and what is left of its coordinates.
PHI_WIDE_VECTORS void FindCells(int width, int height, int n, const float* __restrict u, const float* __restrict v,
                                std::int32_t* __restrict places, float* __restrict fu, float* __restrict fv) {
  for (int i = 0; i < n; ++i) {
    const int x = std::min(static_cast<int>(u[i]), width - 2), y = std::min(static_cast<int>(v[i]), height - 2);
    places[i] = y * width + x;
    fu[i] = u[i] - static_cast<float>(x);
    fv[i] = v[i] - static_cast<float>(y);
  }
}

// Bilinear between two pixels of the row above and two of the row below, the left one in the lower byte.
PHI_WIDE_VECTORS void Interpolate(int n, const std::int32_t* __restrict above, const std::int32_t* __restrict below,
                                  const float* __restrict fu, const float* __restrict fv, float shift,
                                  float* __restrict samples) {
  const auto between = [](std::int32_t pair, float f) {
    const std::int32_t left = pair & 255, right = pair >> 8;
    return static_cast<float>(left) + f * static_cast<float>(right - left);
  };
  for (int i = 0; i < n; ++i) {
    const float top = between(above[i], fu[i]), bottom = between(below[i], fu[i]);
    samples[i] = top + fv[i] * (bottom - top) - shift;
  }
}

}  // namespace

HypothesisMatcher::HypothesisMatcher(const InferenceInput& input, const Hypotheses& hypotheses,
                                     const StereoOptions& stereo, const Method& method)
    : reference_{input.reference.image->view()},
      parameters_(MakeInferenceParameters(input, stereo, method)),
      state_(hypotheses.state()) {
  for (std::size_t j = 0; j < static_cast<std::size_t>(parameters_.num_views); ++j) {
    sources_.push_back({input.sources[j].image->view()});
    views_.push_back(MakeRelativeView(input.reference.view->camera, input.sources[j].view->camera));
    const auto depths = input.DepthsOf(j);
    source_depths_.push_back(depths != nullptr ? depths->view() : MeasuredDepthsView{});
  }
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
  const int n = static_cast<int>(offset_u_.size());
  PlaceSamples(u, v, reference_.image.width, reference_.image.height, n, offset_u_.data(), offset_v_.data(),
               scratch->u.data(), scratch->v.data());
  SampleGray(reference_.image, center, n, scratch, scratch->reference.data());
}

void HypothesisMatcher::SampleMap(ArrayView2D<const float> inverse_depth, int x, int y, Scratch* scratch) const {
  SampleInverseDepths(inverse_depth, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, inverse_depth(x, y),
                      static_cast<int>(offset_u_.size()), offset_u_.data(), offset_v_.data(), scratch->inverse_depth.data());
}

// At the array coordinates in scratch->u and v, less `shift`.
void HypothesisMatcher::SampleGray(ArrayView2D<const std::uint8_t> image, float shift, int num_samples, Scratch* scratch,
                                   float* samples) {
  FindCells(image.width, image.height, num_samples, scratch->u.data(), scratch->v.data(), scratch->above.data(),
            scratch->fu.data(), scratch->fv.data());
  for (int i = 0; i < num_samples; ++i) {
    const std::uint8_t *p = image.data + scratch->above[i], *q = p + image.width;
    scratch->above[i] = p[0] | p[1] << 8;
    scratch->below[i] = q[0] | q[1] << 8;
  }
  Interpolate(num_samples, scratch->above.data(), scratch->below.data(), scratch->fu.data(), scratch->fv.data(), shift,
              samples);
}

PHI_WIDE_VECTORS float HypothesisMatcher::ViewCost(int view, int x, int y, Scratch* scratch) const {
  const int padded = static_cast<int>(offset_u_.size());
  const Vec3f center = views_[view].a * Vec3f{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f};
  if (!ProjectSamples(views_[view], center, padded, offset_u_.data(), offset_v_.data(), scratch->inverse_depth.data(),
                      scratch->u.data(), scratch->v.data())) {
    return kMaxCost;
  }
  const GraySampler& source = sources_[view];
  const int n = parameters_.window.NumSamples();
  float* samples = scratch->source.data();
  const float shift = source(scratch->u[n / 2] + 0.5f, scratch->v[n / 2] + 0.5f);
  SampleGray(source.image, shift, n, scratch, samples);
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

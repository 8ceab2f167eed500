#include "phi/inference/hypothesis_matcher.h"

#include <algorithm>

#include "phi/base/wide_vectors.h"
#include "phi/inference/infer_setup.h"

namespace phi {
namespace {

constexpr int kLanes = 8;  // independent partial sums, so that the compiler may use vector registers

// What follows is arrays with an element for each of n samples of a window; the functions take them by value and apart, so that the
// compiler sees that no array changes another.

// From the window's centre, pixels.
struct SampleOffsets {
  int n;
  const float *__restrict u, *__restrict v;
};

// Array coordinates in an image.
struct SamplePoints {
  float *__restrict u, *__restrict v;
};

// Two pixels of the row above a sample and two of the row below, the left one in the lower byte, and the sample's place between them.
struct SampleCells {
  std::int32_t *__restrict above, *__restrict below;
  float *__restrict fu, *__restrict fv;
};

// The window's centre is `center` in the source but for its inverse depth; w: inverse depths. Writes the samples' places in the source
// image; returns whether all lie in it.
PHI_WIDE_VECTORS bool ProjectSamples(const RelativeView view, Vec3f center, const SampleOffsets offsets, const float* __restrict w,
                                     const SamplePoints points) {
  const float* const a = view.a.m;
  const float max_x = static_cast<float>(view.source.width - 1), max_y = static_cast<float>(view.source.height - 1);
  int is_inside = 1;
  for (int i = 0; i < offsets.n; ++i) {
    const float du = offsets.u[i], dv = offsets.v[i];
    const float px = center.x + a[0] * du + a[1] * dv + w[i] * view.b.x;
    const float py = center.y + a[3] * du + a[4] * dv + w[i] * view.b.y;
    const float pz = center.z + a[6] * du + a[7] * dv + w[i] * view.b.z;
    const float inverse = 1.0f / pz;
    const float qx = px * inverse - 0.5f, qy = py * inverse - 0.5f;
    is_inside &= (pz > 0) & (qx >= 0) & (qy >= 0) & (qx <= max_x) & (qy <= max_y);
    points.u[i] = qx;
    points.v[i] = qy;
  }
  return is_inside != 0;
}

// The samples around `center`, clamped to the border.
PHI_WIDE_VECTORS void PlaceSamples(ImagePoint center, int width, int height, const SampleOffsets offsets, const SamplePoints points) {
  const float max_x = static_cast<float>(width - 1), max_y = static_cast<float>(height - 1);
  for (int i = 0; i < offsets.n; ++i) {
    points.u[i] = Clamp(center.u + offsets.u[i] - 0.5f, 0.0f, max_x);
    points.v[i] = Clamp(center.v + offsets.v[i] - 0.5f, 0.0f, max_y);
  }
}

// SampleInverseDepth of each sample around `at`, where the map has `own`.
PHI_WIDE_VECTORS void SampleInverseDepths(const ArrayView2D<const float> map, ImagePoint at, float own, const SampleOffsets offsets,
                                          float* __restrict samples) {
  for (int i = 0; i < offsets.n; ++i) samples[i] = SampleInverseDepth(map, at.u + offsets.u[i], at.v + offsets.v[i], own);
}

// Writes to `above` the place of the pixel above and left of the sample in an image's rows, and where the sample lies from there.
PHI_WIDE_VECTORS void FindCells(int width, int height, int n, const SamplePoints points, const SampleCells cells) {
  for (int i = 0; i < n; ++i) {
    const float u = points.u[i], v = points.v[i];
    const int x = std::min(static_cast<int>(u), width - 2), y = std::min(static_cast<int>(v), height - 2);
    cells.above[i] = y * width + x;
    cells.fu[i] = u - static_cast<float>(x);
    cells.fv[i] = v - static_cast<float>(y);
  }
}

// Bilinear, less `shift`.
PHI_WIDE_VECTORS void Interpolate(int n, const SampleCells cells, float shift, float* __restrict samples) {
  const auto between = [](std::int32_t pair, float f) {
    const std::int32_t left = pair & 255, right = pair >> 8;
    return static_cast<float>(left) + f * static_cast<float>(right - left);
  };
  for (int i = 0; i < n; ++i) {
    const float top = between(cells.above[i], cells.fu[i]), bottom = between(cells.below[i], cells.fu[i]);
    samples[i] = top + cells.fv[i] * (bottom - top) - shift;
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
  const ImagePoint center = {static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f};
  const int n = static_cast<int>(offset_u_.size());
  PlaceSamples(center, reference_.image.width, reference_.image.height, {n, offset_u_.data(), offset_v_.data()},
               {scratch->u.data(), scratch->v.data()});
  SampleGray(reference_.image, reference_(center.u, center.v), n, scratch, scratch->reference.data());
}

void HypothesisMatcher::SampleMap(ArrayView2D<const float> inverse_depth, int x, int y, Scratch* scratch) const {
  SampleInverseDepths(inverse_depth, {static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f}, inverse_depth(x, y),
                      {static_cast<int>(offset_u_.size()), offset_u_.data(), offset_v_.data()}, scratch->inverse_depth.data());
}

// At the array coordinates in scratch->u and v, less `shift`.
void HypothesisMatcher::SampleGray(ArrayView2D<const std::uint8_t> image, float shift, int num_samples, Scratch* scratch,
                                   float* samples) {
  const SampleCells cells = {scratch->above.data(), scratch->below.data(), scratch->fu.data(), scratch->fv.data()};
  FindCells(image.width, image.height, num_samples, {scratch->u.data(), scratch->v.data()}, cells);
  for (int i = 0; i < num_samples; ++i) {
    const std::uint8_t *p = image.data + cells.above[i], *q = p + image.width;
    cells.above[i] = p[0] | p[1] << 8;
    cells.below[i] = q[0] | q[1] << 8;
  }
  Interpolate(num_samples, cells, shift, samples);
}

PHI_WIDE_VECTORS float HypothesisMatcher::ViewCost(int view, int x, int y, Scratch* scratch) const {
  const int padded = static_cast<int>(offset_u_.size());
  const Vec3f center = views_[view].a * Vec3f{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f};
  if (!ProjectSamples(views_[view], center, {padded, offset_u_.data(), offset_v_.data()}, scratch->inverse_depth.data(),
                      {scratch->u.data(), scratch->v.data()})) {
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

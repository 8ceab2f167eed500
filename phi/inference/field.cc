#include "phi/inference/field.h"

#include <algorithm>
#include <atomic>

#include <tbb/parallel_for.h>

namespace phi {

static_assert(kNumDirections <= kMaxLabels);

Field::Field(const Hypotheses& hypotheses, const HypothesisMatcher& matcher, const InferenceOptions& options)
    : potentials_(options) {
  const ArrayView2D<const float> full = hypotheses.maps().inverse_depth[0];
  width_ = (full.width + kFieldStride - 1) / kFieldStride;
  height_ = (full.height + kFieldStride - 1) / kFieldStride;
  const std::size_t n = static_cast<std::size_t>(width_) * height_;
  measured_ = Array2D<float>(width_, height_, 0.0f);
  allowed_.assign(n, 0);
  inverse_depth_.assign(kMaxLabels * n, 0.0f);
  unary_.assign(kMaxLabels * n, 0);
  for (int j = 0; j < height_; ++j) {
    for (int i = 0; i < width_; ++i) {
      const int x = kFieldStride * i, y = kFieldStride * j;
      if (hypotheses.measured(x, y)) measured_(i, j) = full(x, y);
    }
  }
  unlabelled_ = measured_;
  std::atomic<std::int64_t> num_without{0}, num_seen_through{0}, num_mismatched{0};
  tbb::parallel_for(0, height_, [&](int j) {
    HypothesisMatcher::Scratch scratch;
    std::int64_t without = 0, seen_through = 0, mismatched = 0;
    for (int i = 0; i < width_; ++i) {
      if (measured_(i, j) > 0) continue;
      const PixelHypotheses pixel = matcher.Costs(kFieldStride * i, kFieldStride * j, &scratch);
      without += pixel.offered == 0;
      seen_through += pixel.AllSeenThrough();
      mismatched += pixel.AllMismatched();
      if (pixel.AllRefused()) unlabelled_(i, j) = kRefusedNode;
      AddNode(hypotheses, pixel, i, j);
    }
    num_without += without;
    num_seen_through += seen_through;
    num_mismatched += mismatched;
  });
  counts_.num_nodes = static_cast<std::int64_t>(n) - std::count(allowed_.begin(), allowed_.end(), 0);
  counts_.num_without_hypothesis = num_without;
  counts_.num_seen_through = num_seen_through;
  counts_.num_mismatched = num_mismatched;
}

void Field::AddNode(const Hypotheses& hypotheses, const PixelHypotheses& pixel, int i, int j) {
  constexpr int kOffsets[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
  const HypothesisMaps maps = hypotheses.maps();
  const PotentialView potentials = potentials_.view();
  const int x = kFieldStride * i, y = kFieldStride * j;
  const std::size_t node = static_cast<std::size_t>(j) * width_ + i;
  allowed_[node] = pixel.allowed;
  for (int k = 0; k < kNumDirections; ++k) {
    if (!(pixel.allowed >> k & 1)) continue;
    const float w = maps.inverse_depth[k](x, y);
    std::int32_t energy = UnaryEnergy(potentials, pixel.cost[k]);
    for (const auto& offset : kOffsets) {
      const int ni = i + offset[0], nj = j + offset[1];
      if (measured_.view().Contains(ni, nj) && measured_(ni, nj) > 0) {
        energy += PairwiseEnergy(potentials, w, measured_(ni, nj));
      }
    }
    inverse_depth_[kMaxLabels * node + k] = w;
    unary_[kMaxLabels * node + k] = energy;
  }
}

FieldView Field::view() const {
  FieldView view;
  view.width = width_;
  view.height = height_;
  view.potentials = potentials_.view();
  view.allowed = allowed_.data();
  view.inverse_depth = inverse_depth_.data();
  view.unary = unary_.data();
  return view;
}

Array2D<float> Field::ChosenInverseDepth(const std::vector<std::uint8_t>& labels) const {
  Array2D<float> chosen = unlabelled_;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] != kNoLabel) chosen.data()[i] = inverse_depth_[kMaxLabels * i + labels[i]];
  }
  return chosen;
}

}  // namespace phi

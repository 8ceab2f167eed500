#include "phi/inference/field.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include <tbb/parallel_for.h>

namespace phi {

static_assert(kNumDirections <= kMaxLabels);

Field::Field(const HypothesisMatcher& matcher, const InferenceOptions& options) : potentials_(options) {
  const ArrayView2D<const float> full = HypothesisMatcher::Context(matcher).state.evidence;
  width_ = NumNodesAlong(full.width);
  height_ = NumNodesAlong(full.height);
  const std::size_t n = static_cast<std::size_t>(width_) * height_;
  Array2D<float> evidence(width_, height_);
  unlabelled_ = Array2D<float>(width_, height_);
  allowed_.assign(n, 0);
  inverse_depth_.assign(kMaxLabels * n, 0.0f);
  unary_.assign(kMaxLabels * n, 0);
  for (int j = 0; j < height_; ++j) {
    for (int i = 0; i < width_; ++i) evidence(i, j) = full(kFieldStride * i, kFieldStride * j);
  }
  std::atomic<std::int64_t> num_without{0};
  tbb::parallel_for(0, height_, [&](int j) {
    const HypothesisMatcher::Context context(matcher);
    std::int64_t without = 0;
    for (int i = 0; i < width_; ++i) {
      const FieldNode node = MakeFieldNode(context, potentials_.view(), std::as_const(evidence).view(), i, j);
      SetNode(i, j, node);
      without += !(evidence(i, j) > 0) && node.hypotheses.offered == 0;
    }
    num_without += without;
  });
  counts_.num_nodes = static_cast<std::int64_t>(n) - std::count(allowed_.begin(), allowed_.end(), 0);
  counts_.num_without_hypothesis = num_without;
}

void Field::SetNode(int i, int j, const FieldNode& node) {
  const std::size_t index = static_cast<std::size_t>(j) * width_ + i;
  unlabelled_(i, j) = node.unlabelled;
  allowed_[index] = node.hypotheses.offered;
  std::copy_n(node.inverse_depth, kNumDirections, &inverse_depth_[kMaxLabels * index]);
  std::copy_n(node.unary, kNumDirections, &unary_[kMaxLabels * index]);
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

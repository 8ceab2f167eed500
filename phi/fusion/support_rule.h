// The support rule of fusion, per pixel: where do the images that agree with a pixel put the surface, and do they
// agree well enough? The depth is a robust mean around the median; support is the sum of the other images'
// agreements, so that one image in close agreement counts as much as several that just pass.
#pragma once

#include "phi/fusion/neighbor_lookup.h"

namespace phi {

// An upper bound for the neighbours of one image: a pixel's measurements live on the stack.
inline constexpr int kMaxFusionNeighbors = 256;

// One image's opinion on where the surface lies along the reference ray. Without initial values: an array of these
// is set up for every pixel.
struct Measurement {
  static constexpr int kReference = -1, kDropped = -2;

  int neighbor;          // index into the image's neighbours, or one of the above
  float relative_depth;  // over the reference depth, minus 1
  float agreement;       // [0, 1]: how well reprojection and normal agree
  const FusionPixel* pixel;
};

struct Consensus {
  float relative_depth = 0;
  float support = 0;  // sum of the other images' agreements, depth included
  int num_views = 0;  // that agree with the consensus, the reference included
};

// 1 at no error, 0 at the gate and beyond; smooth, so that a small change of a map changes the support little.
PHI_HD float SoftAgreement(float error, float gate) {
  const float r = error / gate;
  return r < 1 ? 1 - r * r : 0;
}

PHI_HD Measurement MakeMeasurement(const NeighborAnswer& answer, int neighbor, const FusionGates& gates) {
  const float agreement = SoftAgreement(answer.reproj_error, gates.max_reproj_error) *
                          SoftAgreement(1 - answer.normal_cosine, 1 - gates.min_normal_cosine);
  return {neighbor, answer.relative_depth, agreement, answer.pixel};
}

PHI_HD float MedianRelativeDepth(const Measurement* measurements, int count) {
  float sorted[kMaxFusionNeighbors + 1];
  for (int i = 0; i < count; ++i) {  // by insertion: there are few
    const float value = measurements[i].relative_depth;
    int place = i;
    for (; place > 0 && sorted[place - 1] > value; --place) sorted[place] = sorted[place - 1];
    sorted[place] = value;
  }
  return 0.5f * (sorted[(count - 1) / 2] + sorted[count / 2]);
}

// Marks measurements outside the depth tolerance around the median as dropped.
PHI_HD Consensus FindConsensus(Measurement* measurements, int count, const FusionGates& gates) {
  // A measurement that only just passes the reprojection or normal gate still says something about depth.
  constexpr float kLeastWeight = 0.1f;
  const float median = MedianRelativeDepth(measurements, count);
  Consensus consensus;
  float weight_sum = 0, sum = 0;
  for (int i = 0; i < count; ++i) {
    Measurement& m = measurements[i];
    const float near = SoftAgreement(fabsf(m.relative_depth - median), gates.max_depth_error);
    if (near <= 0) {
      m.neighbor = Measurement::kDropped;
      continue;
    }
    const float weight = near * (kLeastWeight + m.agreement);
    weight_sum += weight;
    sum += weight * m.relative_depth;
    ++consensus.num_views;
    if (m.neighbor != Measurement::kReference) consensus.support += near * m.agreement;
  }
  consensus.relative_depth = weight_sum > 0 ? sum / weight_sum : median;
  return consensus;
}

}  // namespace phi

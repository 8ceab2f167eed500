// The hypotheses of an image whose regions choose once, by the evidence.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "phi/inference/hypotheses.h"

namespace phi {

inline Hypotheses RegionHypotheses(const MeasurementMap& measured, const Rules& rules, const GrayImage& image,
                                   std::shared_ptr<const ImageRegions> regions, std::uint32_t image_id = 0,
                                   const PlaneEvidence& evidence = {}) {
  Array2D<float> anchors = AnchorMap(measured, Formulas::kRobust);
  RegionPlanes planes(std::move(regions), std::as_const(anchors).view(), image_id, evidence, rules);
  return {measured, rules, image, std::move(anchors), std::move(planes)};
}

}  // namespace phi

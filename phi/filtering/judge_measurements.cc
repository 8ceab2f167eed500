#include "phi/filtering/judge_measurements.h"

#include "phi/filtering/neighbor_agreement.h"
#include "phi/filtering/own_texture.h"

namespace phi {

void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision, MeasurementMap* map) {
  DropPlainPixels(image, noise, map);
  JudgeByNeighbors(precision, map);
}

}  // namespace phi

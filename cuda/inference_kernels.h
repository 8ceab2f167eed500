// Launches of plane hypothesis inference (paper section E). Kernels run the functions of phi/inference per pixel.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "cuda/error.h"
#include "cuda/texture_sampler.h"
#include "phi/inference/infer_pixel.h"
#include "phi/inference/trws_node.h"

namespace phi::gpu {

struct InferenceSource {
  RelativeView view;
  TextureSampler texture;
  MeasuredDepthsView measured = {};  // no data: unknown
};

// Passed to the kernels by value. All arrays are on the device.
struct InferenceLaunch {
  InferenceParameters parameters;
  TextureSampler reference_texture;
  const InferenceSource* sources = nullptr;  // parameters.num_views

  ArrayView2D<const PlaneHypothesis> measured;
  ArrayView2D<PixelState> states;  // the measured map's; at last those of the result
  ArrayView2D<float> evidence;                    // inverse depth of what is evidence; 0 elsewhere, at holes
  ArrayView2D<float> carrying;                    // inverse depth of what carries planes, 0 elsewhere
  ArrayView2D<float> hypotheses[kNumDirections];  // inverse depth; outside gaps the pixel's own
  ArrayView2D<float> region_planes[kPlanesPerRegion];  // inverse depth of the region's planes, 0 = none
  ArrayView2D<float> inferred;                         // inverse depth of filled pixels, 0 elsewhere
  ArrayView2D<float> filled_and_measured;              // inverse depth
  ArrayView2D<PlaneHypothesis> result;
  // The same bytes, first for lines, then for what follows them.
  ArrayView2D<std::uint8_t> line_limits;  // LineLimit bits; no data: none
  ArrayView2D<std::uint8_t> from_region;  // no data, or bit k: hypothesis k is a region's plane

  HypothesisState State() const;
};

// The field's arrays, as FieldView has them, with write access.
struct FieldLaunch {
  FieldView view;
  std::uint8_t* allowed = nullptr;
  float* inverse_depth = nullptr;
  std::int32_t* unary = nullptr;
  ArrayView2D<float> evidence;  // inverse depth at the nodes' pixels, 0 at holes
  ArrayView2D<float> chosen;    // as Field::ChosenInverseDepth; FieldNode::unlabelled until labels are chosen
  std::uint8_t* best_labels = nullptr;  // of the pass with the lowest energy
  std::int64_t* totals = nullptr;       // FieldTotal entries
};

// Sums over the field, in the tables' units, kept on the device.
enum FieldTotal {
  kNumNodes = 0,
  kEnergy,
  kLowerBound,
  kBestEnergy,
  kMinCostEnergy,
  kIsBetter,
  kUnlikeMinCost,
  kWithoutHypothesis,
  kNumFieldTotals
};

// The points that lines and planes rest on; the four hypothesis maps from them; and the planes of evenly coloured
// regions in the diagonals' places, with no hypothesis at overexposed holes.
void LaunchInverseDepths(const InferenceLaunch& launch, cudaStream_t stream, const Task& task);
void LaunchScanlines(const InferenceLaunch& launch, cudaStream_t stream, const Task& task);
void LaunchRegionPlanes(const InferenceLaunch& launch, cudaStream_t stream, const Task& task);

// Each hole's hypothesis of lowest cost.
void LaunchMinCostChoice(const InferenceLaunch& launch, cudaStream_t stream, const Task& task);

// Nodes and energies; message passing; the chosen depths at full size.
void LaunchFieldSetup(const InferenceLaunch& launch, const FieldLaunch& field, cudaStream_t stream,
                      const Task& task);
void LaunchFieldSolution(const FieldLaunch& field, int num_passes, cudaStream_t stream, const Task& task);
void LaunchFieldChoice(const InferenceLaunch& launch, const FieldLaunch& field, cudaStream_t stream,
                       const Task& task);

// The measured map with the inferred pixels and their normals.
void LaunchComposition(const InferenceLaunch& launch, cudaStream_t stream, const Task& task);

}  // namespace phi::gpu

// Message passing over the field, with exactly the sequential order's result.
//
// Tiles on one anti-diagonal depend only on the diagonals before it, so a diagonal is one launch; inside a tile a warp
// goes over the nodes' anti-diagonals, one row a lane. Every node sees its neighbours in the state that the
// sequential raster order gives them.
//
// That is a chain of thousands of steps, whose latency is the sweep's time. All that a step needs is therefore in shared
// memory (cuda/trws_tile.cuh), and what does not depend on other steps is worked out before by a whole block.
#include "cuda/inference_kernels.h"
#include "cuda/transfer.h"
#include "cuda/trws_tile.cuh"

namespace phi::gpu {
namespace {

constexpr int kBlock = 256;
constexpr int kEnergyTile = 32;  // nodes on a side

__device__ __forceinline__ void AddTotal(const FieldLaunch& field, FieldTotal total, std::int64_t value) {
  // Two's complement: the unsigned sum has the same bits.
  atomicAdd(reinterpret_cast<unsigned long long*>(field.totals + total),
            static_cast<unsigned long long>(value));
}

// Tile `first_row + blockIdx.x` of the diagonal.
template <bool kForward>
__global__ void __launch_bounds__(kBlock)
    SweepKernel(const __grid_constant__ FieldLaunch field, int diagonal, int first_row) {
  extern __shared__ int4 memory[];
  const FieldView& view = field.view;
  const int tile_row = first_row + blockIdx.x;
  const FieldTile tile(memory, (diagonal - tile_row) * kTileColumns, tile_row * kTileRows);
  if (!tile.LoadAllowed(view)) return;
  tile.Load(view);
  __syncthreads();
  if (threadIdx.x < kTileRows) {
    const std::int64_t bound = SweepTile<kForward>(tile, threadIdx.x);
    if (!kForward && bound != 0) AddTotal(field, kLowerBound, bound);
  }
  __syncthreads();
  tile.Store<kForward>(view);
}

template <bool kForward>
void LaunchSweep(const FieldLaunch& field, cudaStream_t stream, const Task& task) {
  Check(cudaFuncSetAttribute(SweepKernel<kForward>, cudaFuncAttributeMaxDynamicSharedMemorySize, kTileBytes),
        "cudaFuncSetAttribute", task);
  const int columns = (field.view.width + kTileColumns - 1) / kTileColumns,
            rows = (field.view.height + kTileRows - 1) / kTileRows;
  const int num_diagonals = columns + rows - 1;
  for (int i = 0; i < num_diagonals; ++i) {
    const int diagonal = kForward ? i : num_diagonals - 1 - i;
    const int first = diagonal - columns + 1 > 0 ? diagonal - columns + 1 : 0;
    const int last = diagonal < rows - 1 ? diagonal : rows - 1;
    SweepKernel<kForward><<<last - first + 1, kBlock, kTileBytes, stream>>>(field, diagonal, first);
    CheckLaunch("SweepKernel", task);
  }
}

__global__ void MinUnaryKernel(const __grid_constant__ FieldLaunch field, std::int64_t num_nodes) {
  const std::int64_t node = static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (node >= num_nodes) return;
  const std::uint8_t allowed = field.view.allowed[node];
  field.view.label[node] =
      allowed != 0 ? static_cast<std::uint8_t>(ArgMin(field.view.unary + kMaxLabels * node, allowed))
                   : kNoLabel;
}

// Adds the energy of the labels to totals[total], and, where asked, counts the nodes.
__global__ void EnergyKernel(const __grid_constant__ FieldLaunch field, FieldTotal total, bool count_nodes) {
  const int x = blockIdx.x * kEnergyTile + threadIdx.x % kEnergyTile;
  std::int64_t energy = 0;
  int count = 0;
  for (int row = threadIdx.x / kEnergyTile; row < kEnergyTile; row += kBlock / kEnergyTile) {
    const int y = blockIdx.y * kEnergyTile + row;
    if (x >= field.view.width || y >= field.view.height) continue;
    energy += NodeEnergy(field.view, x, y);
    count += field.view.allowed[NodeIndex(field.view, x, y)] != 0;
  }
  if (energy != 0) AddTotal(field, total, energy);
  if (count_nodes && count > 0) AddTotal(field, kNumNodes, count);
}

void LaunchEnergy(const FieldLaunch& field, FieldTotal total, bool count_nodes, cudaStream_t stream,
                  const Task& task) {
  const dim3 tiles((field.view.width + kEnergyTile - 1) / kEnergyTile,
                   (field.view.height + kEnergyTile - 1) / kEnergyTile);
  EnergyKernel<<<tiles, kBlock, 0, stream>>>(field, total, count_nodes);
  CheckLaunch("EnergyKernel", task);
}

// Whether this pass has the lowest energy so far; the first among equals stays.
__global__ void ComparePassKernel(const __grid_constant__ FieldLaunch field, int pass) {
  const bool better = pass == 0 || field.totals[kEnergy] < field.totals[kBestEnergy];
  field.totals[kIsBetter] = better;
  if (better) field.totals[kBestEnergy] = field.totals[kEnergy];
}

__global__ void KeepBestLabelsKernel(const __grid_constant__ FieldLaunch field, std::int64_t num_nodes) {
  const std::int64_t node = static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (node < num_nodes && field.totals[kIsBetter]) field.best_labels[node] = field.view.label[node];
}

__global__ void CountUnlikeMinCostKernel(const __grid_constant__ FieldLaunch field, std::int64_t num_nodes) {
  const std::int64_t node = static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (node >= num_nodes || field.view.allowed[node] == 0) return;
  const int cheapest = ArgMin(field.view.unary + kMaxLabels * node, field.view.allowed[node]);
  if (field.best_labels[node] != cheapest) AddTotal(field, kUnlikeMinCost, 1);
}

}  // namespace

void LaunchFieldSolution(const FieldLaunch& field, int num_passes, cudaStream_t stream, const Task& task) {
  const std::int64_t num_nodes = static_cast<std::int64_t>(field.view.width) * field.view.height;
  const int blocks = static_cast<int>((num_nodes + kBlock - 1) / kBlock);
  ClearOnDevice(field.view.horizontal, kMaxLabels * num_nodes, stream, task);
  ClearOnDevice(field.view.vertical, kMaxLabels * num_nodes, stream, task);
  MinUnaryKernel<<<blocks, kBlock, 0, stream>>>(field, num_nodes);
  CheckLaunch("MinUnaryKernel", task);
  LaunchEnergy(field, kMinCostEnergy, true, stream, task);
  for (int pass = 0; pass < num_passes; ++pass) {
    ClearOnDevice(field.totals + kEnergy, 1, stream, task);
    ClearOnDevice(field.totals + kLowerBound, 1, stream, task);
    LaunchSweep<true>(field, stream, task);
    LaunchSweep<false>(field, stream, task);
    LaunchEnergy(field, kEnergy, false, stream, task);
    ComparePassKernel<<<1, 1, 0, stream>>>(field, pass);
    CheckLaunch("ComparePassKernel", task);
    KeepBestLabelsKernel<<<blocks, kBlock, 0, stream>>>(field, num_nodes);
    CheckLaunch("KeepBestLabelsKernel", task);
  }
  CountUnlikeMinCostKernel<<<blocks, kBlock, 0, stream>>>(field, num_nodes);
  CheckLaunch("CountUnlikeMinCostKernel", task);
}

}  // namespace phi::gpu

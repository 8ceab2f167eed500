#include "cuda/fetch_rate.h"

#include <algorithm>

#include "cuda/buffer.h"
#include "cuda/device.h"
#include "cuda/gray_texture.h"
#include "cuda/stream.h"

namespace phi::gpu {
namespace {

constexpr int kSide = 1024;  // pixels of the test image: larger than a multiprocessor's cache, as images are
constexpr int kBlock = 128;
constexpr int kWindow = 16;  // samples on a side of the window that a thread reads
constexpr int kWindowsPerThread = 8;

__global__ void FetchKernel(TextureSampler texture, float* sums) {
  // As the estimation's threads: a warp's windows lie in 8 x 8 pixels.
  const int lane = threadIdx.x & 31, warp = blockIdx.x * (kBlock / 32) + (threadIdx.x >> 5);
  float u = 8.3f * (warp % 64) + 1.0f * (lane & 7), v = 8.3f * (warp / 64 % 64) + 2.0f * (lane >> 3);
  float sum = 0;
  for (int window = 0; window < kWindowsPerThread; ++window) {
    for (int row = 0; row < kWindow; ++row) {
#pragma unroll
      for (int column = 0; column < kWindow; ++column) {
        sum += tex2D<float>(texture.texture, u + 1.4f * column, v + 1.4f * row);
      }
    }
    u += 1.7f;
    v += 0.6f;
  }
  sums[blockIdx.x * kBlock + threadIdx.x] = sum;
}

}  // namespace

double MeasureFetchRate() {
  constexpr int kBlocks = 1 << 13, kMostRuns = 100;
  constexpr double kWarmUpSeconds = 0.02,
                   kSamples = 1.0 * kBlocks * kBlock * kWindow * kWindow * kWindowsPerThread;
  const Task task{.stage = "measurement of the fetch rate"};
  const Stream stream(task);
  const GrayTexture image(GrayImage(kSide, kSide, 100), stream.get(), task);
  const DeviceBuffer<float> sums(kBlocks * kBlock, task);
  const Event begin(Event::Timing::kOn, task), end(Event::Timing::kOn, task);
  double best = 0, total = 0;
  for (int run = 0; run < kMostRuns && total < kWarmUpSeconds; ++run) {
    begin.Record(stream.get(), task);
    FetchKernel<<<kBlocks, kBlock, 0, stream.get()>>>({image.get()}, sums.data());
    CheckLaunch("FetchKernel", task);
    end.Record(stream.get(), task);
    end.Wait(task);
    const double seconds = Event::SecondsBetween(begin, end, task);
    total += seconds;
    best = std::max(best, kSamples / seconds);
  }
  return best;
}

}  // namespace phi::gpu

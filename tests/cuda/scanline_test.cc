// Lines by warps against FillScanline.
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "cuda/buffer.h"
#include "cuda/inference_kernels.h"
#include "cuda/stream.h"
#include "phi/base/images.h"
#include "phi/base/random.h"
#include "phi/inference/line_hypothesis.h"
#include "tests/cuda/cuda_test_fixture.h"

namespace phi::gpu {
namespace {

class ScanlineTest : public CudaTest {};

using Lines = std::vector<Array2D<float>>;  // of each direction

Lines OnCpu(const Array2D<float>& anchors, const Mask& limits, const LineOptions& options) {
  Lines lines;
  for (int direction = 0; direction < kNumDirections; ++direction) {
    Array2D<float>& filled = lines.emplace_back(anchors);
    for (int i = 0; i < NumScanlines(direction, anchors.width(), anchors.height()); ++i) {
      FillScanline(MakeScanline(direction, i, anchors.width(), anchors.height()), anchors.view(), limits.view(), options, filled.view());
    }
  }
  return lines;
}

// All of `anchors` were measured.
Lines OnGpu(const Array2D<float>& anchors, const Mask& limits, Formulas formulas) {
  const int width = anchors.width(), height = anchors.height();
  const auto count = static_cast<std::int64_t>(anchors.size());
  const Task task{"test", "", width, height};
  const Stream stream(task);
  const DeviceBuffer<float> carrying(count, task), evidence(count, task), filled(kNumDirections * count, task);
  const DeviceBuffer<std::uint8_t> device_limits(count, task);
  carrying.Upload(anchors.data(), count, stream.get(), task);
  evidence.Upload(anchors.data(), count, stream.get(), task);
  device_limits.Upload(limits.data(), count, stream.get(), task);
  InferenceLaunch launch;
  launch.parameters.method.formulas = formulas;
  launch.carrying = carrying.View(width, height);
  launch.evidence = evidence.View(width, height);
  launch.line_limits = device_limits.View(width, height);
  for (int k = 0; k < kNumDirections; ++k) launch.hypotheses[k] = {filled.data() + k * count, width, height};
  LaunchScanlines(launch, stream.get(), task);
  Lines lines;
  for (int k = 0; k < kNumDirections; ++k) {
    CopyToHost(lines.emplace_back(width, height).data(), filled.data() + k * count, count, stream.get(), task);
  }
  stream.Synchronize(task);
  return lines;
}

// Slanted ground, of which runs are left: some of one pixel, some longer than a warp, and in a part of the image none. Depth steps
// between its thirds.
Array2D<float> Anchors(int width, int height) {
  Array2D<float> anchors(width, height, 0.0f);
  for (int y = 0; y < height; ++y) {
    for (int x = 0, left = 0, is_run = 0; x < width; ++x, --left) {
      if (left <= 0) {
        const Random4 random = Philox({5, 0}, 0, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
        is_run = 1 - is_run;
        left = 1 + static_cast<int>(random.v[0] % (random.v[1] % 4 == 0 ? 70 : 6));
      }
      const float step = x > 2 * width / 3 ? 0.1f : 0.0f;
      if (is_run != 0 && x < 9 * width / 10) anchors(x, y) = 0.3f + step + 1e-4f * static_cast<float>(x + 2 * y);
    }
  }
  for (int x = 0; x < width; ++x) anchors(x, height / 2) = 0;  // a scanline without any
  return anchors;
}

Mask Limits(int width, int height) {
  Mask limits(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) limits(x, y) = x / 20 % 5 == 1 ? kNoLine : y / 10 % 3 == 1 ? kBetweenSidesOnly : 0;
  }
  return limits;
}

void ExpectAlike(int width, int height, Formulas formulas) {
  const Array2D<float> anchors = Anchors(width, height);
  const Mask limits = Limits(width, height);
  const Lines on_cpu = OnCpu(anchors, limits, MakeLineOptions(formulas)), on_gpu = OnGpu(anchors, limits, formulas);
  for (int k = 0; k < kNumDirections; ++k) {
    int num_filled = 0, num_unlike = 0;
    for (std::size_t i = 0; i < anchors.size(); ++i) {
      const float cpu = on_cpu[k].data()[i], gpu = on_gpu[k].data()[i];
      num_filled += cpu > 0 && anchors.data()[i] == 0;
      num_unlike += (cpu > 0) != (gpu > 0) || std::abs(gpu - cpu) > 1e-4f * std::max(cpu, 1.0f);
    }
    EXPECT_GT(num_filled, width * height / 20) << "direction " << k;
    EXPECT_EQ(num_unlike, 0) << "direction " << k << " of " << width << "x" << height;
  }
}

TEST_F(ScanlineTest, FillsTheGapsThatTheProcessorFills) {
  for (const auto& [width, height] : {std::pair(333, 207), std::pair(64, 32), std::pair(97, 310)}) ExpectAlike(width, height, Formulas::kRobust);
}

TEST_F(ScanlineTest, FillsThePapersGaps) { ExpectAlike(160, 121, Formulas::kPaper); }

}  // namespace
}  // namespace phi::gpu

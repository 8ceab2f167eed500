// Compares a GPU with the CPU on a tiny scene, so that a wrong architecture or driver gives a clear error instead of
// empty maps.
#pragma once

#include "cuda/device.h"

namespace phi::gpu {

struct SelfTestOptions {
  int width = 48, height = 36;  // pixels of the test image
  int num_iterations = 1;
};

struct SelfTestReport {
  double agreement = 0;  // share of pixels whose depths on the GPU and on the CPU differ by less than 1 %
  double accuracy = 0;   // share of the GPU's pixels within 2 % of the scene's depth
  double cpu_accuracy = 0;
};

// Estimates the test image on both.
SelfTestReport RunSelfTest(const DeviceProperties& device, const SelfTestOptions& options);

// Throws phi::DeviceError with the reason when the device fails the short test (milliseconds).
void RequireWorkingDevice(const DeviceProperties& device);

}  // namespace phi::gpu

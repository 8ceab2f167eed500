// The GPUs of this machine.
#pragma once

#include <string>

namespace phi::gpu {

struct DeviceProperties {
  int index = 0;
  std::string name;  // "NVIDIA H200"
  int num_multiprocessors = 0;
};

// Number of CUDA devices, 0 where there is none; then `why_none` (may be null) says why in one sentence.
int NumCudaDevices(std::string* why_none);

// Throws phi::UsageError when there is no device `index`.
DeviceProperties QueryDevice(int index);

// Makes a device current for this thread and restores the former one.
class ScopedDevice {
 public:
  explicit ScopedDevice(int index);
  ~ScopedDevice();
  ScopedDevice(const ScopedDevice&) = delete;
  ScopedDevice& operator=(const ScopedDevice&) = delete;

 private:
  int previous_ = 0;
};

}  // namespace phi::gpu

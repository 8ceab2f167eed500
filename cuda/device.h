// The GPUs of this machine.
#pragma once

#include <cuda.h>

#include <string>
#include <vector>

namespace phi::gpu {

struct DeviceProperties {
  int index = 0;
  std::string name;  // "NVIDIA H200"
  int num_multiprocessors = 0;
};

// Number of CUDA devices, 0 where there is none; then `why_none` (may be null) says why in one sentence.
int NumCudaDevices(std::string* why_none);

// Devices by their indices: none or {-1} means all of the machine's.
std::vector<int> DevicesNamed(std::vector<int> indices, int num_devices);

// Throws phi::UsageError when there is no device `index`.
DeviceProperties QueryDevice(int index);

// Starts devices (DevicesNamed), each by a thread, for calls to come. Says nothing of what fails, since those calls do.
void StartDevices(std::vector<int> indices) noexcept;

// Makes a device current for this thread, and what was current before it again. A thread that had chosen none has none again: to go back
// to CUDA's default would start GPU 0, which may be full, or another program's.
class ScopedDevice {
 public:
  explicit ScopedDevice(int index);
  ~ScopedDevice();
  ScopedDevice(const ScopedDevice&) = delete;
  ScopedDevice& operator=(const ScopedDevice&) = delete;

 private:
  CUcontext previous_ = nullptr;
};

}  // namespace phi::gpu

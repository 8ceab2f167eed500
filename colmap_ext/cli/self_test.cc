// phimvs self_test: compares every GPU of this machine with the CPU on a small scene. Exit code 3 when one fails.
#include <iomanip>
#include <iostream>
#include <string>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/option_parser.h"
#include "phi/base/error.h"
#ifdef PHIMVS_WITH_CUDA
#include "cuda/self_test.h"
#endif

namespace colmap_ext {
namespace {

#ifdef PHIMVS_WITH_CUDA
// True when the device agrees with the CPU.
bool TestDevice(int index) {
  constexpr double kMinAgreement = 0.95;
  const phi::gpu::DeviceProperties device = phi::gpu::QueryDevice(index);
  const phi::gpu::SelfTestReport report =
      phi::gpu::RunSelfTest(device, {.width = 320, .height = 240, .num_iterations = 4});
  const bool passed = report.agreement >= kMinAgreement;
  std::cout << std::fixed << std::setprecision(2) << "cuda:" << index << " " << device.name
            << ": depths agree with the CPU's at " << 100 * report.agreement << " % of the pixels, "
            << 100 * report.accuracy << " % are right (CPU: " << 100 * report.cpu_accuracy << " %): "
            << (passed ? "passed" : "FAILED; update the driver, or run with --PhiStereo.backend cpu")
            << std::endl;
  return passed;
}

int TestDevices() {
  std::string why_none;
  const int num_devices = phi::gpu::NumCudaDevices(&why_none);
  if (num_devices == 0) std::cout << why_none << "; the CPU will be used" << std::endl;
  bool passed = true;
  for (int index = 0; index < num_devices; ++index) passed = TestDevice(index) && passed;
  return static_cast<int>(passed ? phi::ExitCode::kOk : phi::ExitCode::kOutOfResources);
}
#else
int TestDevices() {
  std::cout << "this build has no CUDA backend; the CPU will be used" << std::endl;
  return static_cast<int>(phi::ExitCode::kOk);
}
#endif

}  // namespace

int RunSelfTest(int argc, char** argv) {
  OptionParser parser("self_test", "Compare every GPU with the CPU on a small scene");
  if (!parser.Parse(argc, argv)) return static_cast<int>(phi::ExitCode::kOk);
  return TestDevices();
}

}  // namespace colmap_ext

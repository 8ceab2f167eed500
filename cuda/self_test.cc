#include "cuda/self_test.h"

#include <cmath>
#include <memory>
#include <vector>

#include "cuda/calls_on_gpu.h"
#include "phi/base/device_error.h"
#include "phi/cpu/cpu_estimation.h"

namespace phi::gpu {
namespace {

constexpr double kDepth = 4;  // world units, of the fronto-parallel plane that the scene is

// Grey level of the plane's paint at a point in the reference image's pixels.
double Paint(double u, double v) {
  return 128 + 40 * std::sin(0.9 * u + 0.3 * v) + 35 * std::cos(0.5 * v - 0.35 * u) +
         25 * std::sin(0.13 * u * v / 7);
}

// The reference camera and two that moved sideways and down: a pixel of the plane moves by whole pixels.
struct TestScene {
  std::vector<SceneView> views;
  std::vector<std::shared_ptr<const GrayImage>> images;

  explicit TestScene(const SelfTestOptions& options) {
    const double focal = options.width;
    const int shifts[3][2] = {{0, 0}, {3, 0}, {-1, 2}};  // pixels
    for (const auto& shift : shifts) {
      SceneView view;
      view.name = "self-test";
      view.image_id = static_cast<std::uint32_t>(views.size() + 1);
      view.camera.pinhole = {options.width, options.height,      focal,
                             focal,         0.5 * options.width, 0.5 * options.height};
      view.camera.pose.translation = Eigen::Vector3d(shift[0], shift[1], 0) * (kDepth / focal);
      auto image = std::make_shared<GrayImage>(options.width, options.height);
      for (int y = 0; y < options.height; ++y) {
        for (int x = 0; x < options.width; ++x) {
          (*image)(x, y) = static_cast<std::uint8_t>(std::lround(Paint(x - shift[0], y - shift[1])));
        }
      }
      views.push_back(view);
      images.push_back(std::move(image));
    }
  }

  EstimationInput Input() const {
    EstimationInput input;
    input.reference = {&views[0], images[0]};
    input.sources = {{&views[1], images[1]}, {&views[2], images[2]}};
    input.depth_min = static_cast<float>(0.8 * kDepth);
    input.depth_max = static_cast<float>(1.25 * kDepth);
    return input;
  }
};

double ShareWithin(const PlaneMap& map, double tolerance, const PlaneMap* reference) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double expected = reference ? reference->data()[i].depth : kDepth;
    count += std::abs(map.data()[i].depth - expected) < tolerance * expected;
  }
  return static_cast<double>(count) / static_cast<double>(map.size());
}

}  // namespace

SelfTestReport RunSelfTest(const DeviceProperties& device, const SelfTestOptions& options) {
  const ScopedDevice current(device.index);
  const TestScene scene(options);
  StereoOptions stereo;
  stereo.num_iterations = options.num_iterations;
  DeviceResources resources(device, 0);
  const EstimationResult gpu = EstimateOnGpu(&resources, scene.Input(), stereo);
  const EstimationResult cpu = EstimateOnCpu(scene.Input(), stereo);
  return {ShareWithin(gpu.map, 0.01, &cpu.map), ShareWithin(gpu.map, 0.02, nullptr),
          ShareWithin(cpu.map, 0.02, nullptr)};
}

void RequireWorkingDevice(const DeviceProperties& device) {
  constexpr double kMinAgreement = 0.9;
  const SelfTestReport report = RunSelfTest(device, SelfTestOptions());
  if (report.agreement >= kMinAgreement) return;
  throw DeviceError("cuda:" + std::to_string(device.index) + " " + device.name +
                    " failed the self-test: only " + std::to_string(100 * report.agreement) +
                    " % of its depths agree with the CPU's; update the driver, or run with "
                    "--PhiStereo.backend cpu");
}

}  // namespace phi::gpu

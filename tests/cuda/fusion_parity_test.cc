// Fusion on the GPU gives the host's bytes.
#include "cuda/fuse_on_gpu.h"

#include "phi/base/device_error.h"
#include "tests/cuda/cuda_test_fixture.h"
#include "tests/support/scene_fusers.h"

namespace phi::gpu {
namespace {

using test_support::ExpectSameBytes;
using test_support::FuseAllImages;
using test_support::RenderedScene;

class FusionParityTest : public CudaTest {};

TEST_F(FusionParityTest, GivesTheHostsBytes) {
  FusionOptions few, strict;
  few.max_num_views = 2;
  strict.max_reproj_error = 0.2;
  strict.min_support = 0.2;
  strict.max_normal_error = 3;  // leaves holes
  const BoundingBox box = {{-10, -10, -10}, {0.1, 10, 10}};
  for (const RenderedScene& scene : {test_support::PlaneScene(), test_support::SphereScene()}) {
    for (const FusionOptions& options : {FusionOptions(), few, strict}) {
      for (const BoundingBox* of : {static_cast<const BoundingBox*>(nullptr), &box}) {
        const std::unique_ptr<FusionDevice> device = MakeCudaFusion(0);
        ExpectSameBytes(FuseAllImages(scene, options, of, device.get()), FuseAllImages(scene, options, of, nullptr));
        if (HasFatalFailure()) return;
      }
    }
  }
}

// The copies must make room for each other, with their flags.
TEST_F(FusionParityTest, GivesThemWithLittleMemoryToo) {
  const RenderedScene scene = test_support::SphereScene();
  const std::vector<FusionMap> maps = test_support::MakeMaps(scene);
  const std::int64_t map_bytes = static_cast<std::int64_t>(maps[0].bytes());
  for (const std::int64_t num_maps : {static_cast<std::int64_t>(maps.size()), std::int64_t{2}}) {
    const std::unique_ptr<FusionDevice> device = MakeCudaFusion(0, num_maps * map_bytes);
    for (const FusionMap& map : maps) device->Load(map.view());  // other maps than those that are fused
    ExpectSameBytes(FuseAllImages(scene, {}, nullptr, device.get()), FuseAllImages(scene, {}, nullptr, nullptr));
  }
}

TEST_F(FusionParityTest, RefusesWhatDoesNotFit) {
  const RenderedScene scene = test_support::SphereScene();
  const std::vector<FusionMap> maps = test_support::MakeMaps(scene);
  const std::unique_ptr<FusionDevice> device = MakeCudaFusion(0, static_cast<std::int64_t>(maps[0].bytes()));
  EXPECT_NE(device->Start(maps[0].view(), RayModel(), {}), nullptr);
  FusionNeighbor neighbor;
  neighbor.map = maps[1].view();
  EXPECT_EQ(device->Start(maps[0].view(), RayModel(), {neighbor}), nullptr);
}

}  // namespace
}  // namespace phi::gpu

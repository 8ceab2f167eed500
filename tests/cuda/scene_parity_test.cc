// As many correct pixels on the GPU as on the CPU, on the fixed room and on photos: within 0.3 points over all images.
#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/evaluation/map_evaluation.h"
#include "colmap_ext/synthetic/room.h"
#include "tests/cuda/cuda_test_fixture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_data.h"

namespace phi::gpu {
namespace {

namespace fs = std::filesystem;

constexpr double kPoints = 0.3;

class SceneParityTest : public CudaTest {};

TEST_F(SceneParityTest, FixedRoom) {
  const colmap_ext::RenderedScene scene = colmap_ext::MakeSyntheticRoom().scene;
  const std::array<double, 3> tolerances = {0.005, 0.01, 0.02};
  const std::array<std::unique_ptr<Backend>, 2> backends = {MakeCpuBackend(0),
                                                            std::move(MakeCudaBackends({0}).front())};
  double percent[2][tolerances.size()] = {};
  const int num_images = static_cast<int>(scene.views.size());
  for (int r = 0; r < num_images; ++r) {
    float depth_min = 1e9f, depth_max = 0;
    for (const PlaneHypothesis& h : *scene.truth[r]) {
      if (h.depth > 0) depth_min = std::min(depth_min, h.depth);
      depth_max = std::max(depth_max, h.depth);
    }
    const EstimationInput input = MakeInput(scene, r, 0.8f * depth_min, 1.25f * depth_max);
    for (int b = 0; b < 2; ++b) {
      const EstimationResult result = backends[b]->Estimate(input, StereoOptions());
      for (std::size_t t = 0; t < tolerances.size(); ++t) {
        percent[b][t] += PercentCorrect(result.map, *scene.truth[r], tolerances[t]) / num_images;
      }
    }
  }
  for (std::size_t t = 0; t < tolerances.size(); ++t) {
    EXPECT_GT(percent[0][t], 45) << "the scene does not test what it should";
    EXPECT_NEAR(percent[1][t], percent[0][t], kPoints) << "within " << tolerances[t];
  }
}

// Shares of the scanned or true pixels within 2 and 10 cm in raw maps.
std::vector<double> RawScores(const fs::path& scene, double values_per_unit, const char* backend) {
  const test_support::TemporaryFolder folder;
  const fs::path dense = folder / "dense";
  fs::create_directories(dense / "stereo");
  fs::create_directory_symlink(fs::absolute(scene / "dense/images"), dense / "images");
  fs::create_directory_symlink(fs::absolute(scene / "dense/sparse"), dense / "sparse");
  fs::copy_file(scene / "dense/stereo/patch-match.cfg", dense / "stereo/patch-match.cfg");
  std::vector<std::string> words = {"patch_match_stereo",
                                    "--workspace_path",
                                    dense.string(),
                                    "--PhiStereo.backend",
                                    backend,
                                    "--PatchMatchStereo.max_image_size",
                                    "512",
                                    "--PatchMatchStereo.geom_consistency",
                                    "false",
                                    "--PatchMatchStereo.filter",
                                    "false"};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  EXPECT_EQ(colmap_ext::RunPatchMatchStereo(static_cast<int>(arguments.size()), arguments.data()), 0);
  colmap_ext::MapEvaluationOptions options;
  options.maps = dense / "stereo/depth_maps";
  options.truth = scene / "gt/depth_u16";
  options.kind = "photometric";
  options.values_per_unit = values_per_unit;
  options.thresholds = {0.02, 0.1};
  return colmap_ext::EvaluateDepthMaps(options).Mean().within;
}

void ExpectSameScores(const char* name, double values_per_unit) {
  const fs::path scene = test_support::FindScene(name);
  if (scene.empty()) GTEST_SKIP() << "no scene '" << name << "' (see PHIMVS_TEST_DATA in CONTRIBUTING.md)";
  const std::vector<double> cpu = RawScores(scene, values_per_unit, "cpu"),
                            gpu = RawScores(scene, values_per_unit, "cuda");
  ASSERT_EQ(cpu.size(), gpu.size());
  for (std::size_t t = 0; t < cpu.size(); ++t) {
    EXPECT_GT(cpu[t], 30);
    EXPECT_NEAR(gpu[t], cpu[t], kPoints);
  }
}

TEST_F(SceneParityTest, Fountain) { ExpectSameScores("fountain", 4000); }

TEST_F(SceneParityTest, LivingRoom) { ExpectSameScores("livingroom", 8000); }

}  // namespace
}  // namespace phi::gpu

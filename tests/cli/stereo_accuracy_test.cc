// patch_match_stereo with its defaults, CPU backend, against exact and scanned depth.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>

#include "colmap_ext/evaluation/map_evaluation.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/measurement_file.h"
#include "tests/support/room_run.h"
#include "tests/support/test_data.h"

namespace {

namespace fs = std::filesystem;
using test_support::ProgramResult;
using test_support::RoomRun;
using test_support::RoomScore;
using test_support::TemporaryFolder;

// Pixels of all views that are measured and have no depth in the finished maps. In the room nothing is the sky.
std::int64_t NumMeasuredAndLost(const RoomRun& run) {
  std::int64_t num_lost = 0;
  for (const phi::SceneView& view : run.scene().views) {
    const fs::path folder = run.dense() / "stereo/depth_maps";
    const phi::DepthMap measured = colmap_ext::ReadPublishedDepths(folder / (view.name + ".measured.bin"));
    const phi::DepthMap finished = colmap_ext::ReadDepthMap(folder / (view.name + ".geometric.bin"));
    for (std::size_t i = 0; i < measured.size(); ++i) num_lost += measured.data()[i] > 0 && !(finished.data()[i] > 0);
  }
  return num_lost;
}

// 90 % of the textured pixels seen by three or more views within 0.5 % before the filter, of which the filter keeps 85 %, 98 % of
// these within 1 %. Of all that it keeps 97 % within 1 %: where one view is enough to confirm, paint is less sure.
TEST(StereoAccuracy, FixedRoom) {
  const RoomRun run(colmap_ext::MakeSyntheticRoom());
  const ProgramResult result = run.RunStereo();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const RoomScore score = ScoreRoom(run);
  std::printf(
      "textured: raw within 0.5 %% %.2f %%, kept %.2f %%, of these within 1 %% %.2f %%; all kept: %.2f %%\n",
      score.RawCorrectPercent(), score.KeptTexturedPercent(), score.KeptTexturedCorrectPercent(),
      score.KeptCorrectPercent());
  EXPECT_GE(score.RawCorrectPercent(), 90);           // 92.36
  // With neighbours and probability as judges it kept 94.5 %, 98.9 % of these right, and of all 97.5 %:
  // docs/development/notes/ablations_small_images.md.
  EXPECT_GE(score.KeptTexturedPercent(), 97);           // 98.30
  EXPECT_GE(score.KeptTexturedCorrectPercent(), 97);    // 97.79
  EXPECT_GE(score.KeptCorrectPercent(), 93);            // 95.28
  EXPECT_EQ(NumMeasuredAndLost(run), 0);
}

// Photos with a laser scan. The goal, 55 % within 2 cm and 80 % within 10 cm, is for 768 pixels; it holds at half of
// that already (60 and 89 %), which is quicker.
TEST(StereoAccuracy, Fountain) {
  const fs::path scene = test_support::FindScene("fountain");
  if (scene.empty()) GTEST_SKIP() << "no scene 'fountain' (see PHIMVS_TEST_DATA in CONTRIBUTING.md)";
  const TemporaryFolder folder;
  const fs::path dense = folder / "dense";
  fs::create_directories(dense / "stereo");
  fs::create_directory_symlink(fs::absolute(scene / "dense/images"), dense / "images");
  fs::create_directory_symlink(fs::absolute(scene / "dense/sparse"), dense / "sparse");
  fs::copy_file(scene / "dense/stereo/patch-match.cfg", dense / "stereo/patch-match.cfg");
  const ProgramResult result =
      test_support::RunProgram({PHIMVS_BINARY, "patch_match_stereo", "--workspace_path", dense,
                                "--PhiStereo.backend", "cpu", "--PatchMatchStereo.max_image_size", "384"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  colmap_ext::MapEvaluationOptions options;
  options.maps = dense / "stereo/depth_maps";
  options.truth = scene / "gt/depth_u16";
  options.kind = "photometric";
  options.values_per_unit = 4000;
  options.thresholds = {0.02, 0.1};
  const colmap_ext::MapScore mean = colmap_ext::EvaluateDepthMaps(options).Mean();
  std::printf("within 2 cm: %.2f %%, within 10 cm: %.2f %%\n", mean.within[0], mean.within[1]);
  EXPECT_GE(mean.within[0], 55);
  EXPECT_GE(mean.within[1], 80);
}

}  // namespace

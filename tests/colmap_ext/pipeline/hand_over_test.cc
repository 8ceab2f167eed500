// What the stereo hands to fusion in memory does for the files.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/stereo_pipeline.h"
#include "tests/support/fake_backend.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::ReadBytes;

constexpr int kNumImages = 5;

class HandOver : public ::testing::Test {
 protected:
  void SetUp() override { test_support::WriteNoiseWorkspace(folder_.path(), {.num_images = kNumImages}); }

  // Of a run with a cache of so many gigabytes.
  HandedMaps RunStereo(double cache_gigabytes) {
    const Workspace workspace({.path = folder_.path()});
    const phi::SparseScene scene = MakeSparseScene(workspace.model());
    PipelineOptions options;
    options.cache_gigabytes = cache_gigabytes;
    Backends backends;
    backends.push_back(std::make_unique<test_support::FakeBackend>(&calls_, 2));
    const auto sparse_depth = [](int) { return phi::SparseDepth{{}, {1, 10}}; };
    StereoPipeline pipeline({workspace, MakeImageJobs(workspace, scene, "", options.view_selection), sparse_depth},
                            options, {}, backends);
    pipeline.KeepForFusion();
    EXPECT_EQ(pipeline.Run().Code(), phi::ExitCode::kOk);
    return pipeline.HandOver();
  }

  // The cloud's files and the first image's confidence map.
  std::string Fuse(HandedMaps handed) {
    const Workspace workspace({.path = folder_.path()});
    SceneFusionOptions options;
    options.rule.min_num_views = 1;
    options.write_confidence_maps = true;
    options.scratch_folder = folder_.path();
    const auto writer = MakePlyCloudWriter({.path = folder_ / "cloud.ply"});
    FuseScene(workspace, &handed, options, writer.get());
    writer->Commit();
    const fs::path confidence = workspace.ConfidenceMapPath(0, kGeometric);
    const std::string bytes = ReadBytes(folder_ / "cloud.ply") + ReadBytes(folder_ / "cloud.ply.vis") + ReadBytes(confidence);
    fs::remove(confidence);
    return bytes;
  }

  test_support::TemporaryFolder folder_;
  test_support::FakeCalls calls_;
};

TEST_F(HandOver, FusionReadsNeitherMapsNorPhotosFromFiles) {
  HandedMaps handed = RunStereo(1);
  EXPECT_EQ(handed.num_maps(), kNumImages);
  const std::string cloud = Fuse({});
  ASSERT_GT(cloud.size(), 1000u);
  for (const char* name : {"stereo/depth_maps", "stereo/normal_maps", "stereo/filled_masks", "images"})
    fs::remove_all(folder_ / name);
  EXPECT_TRUE(Fuse(std::move(handed)) == cloud);
}

TEST_F(HandOver, WhatDoesNotFitTheCacheIsReadFromFiles) {
  HandedMaps handed = RunStereo(1e-6);
  EXPECT_EQ(handed.num_maps(), 0);
  EXPECT_TRUE(Fuse(std::move(handed)) == Fuse({}));
}

TEST_F(HandOver, IsTrimmedToTheMemoryLeft) {
  HandedMaps handed = RunStereo(1);
  const std::int64_t all = handed.bytes();
  handed.Trim(all);
  EXPECT_EQ(handed.num_maps(), kNumImages);
  handed.Trim(all / 2);
  EXPECT_LE(handed.bytes(), all / 2);
  EXPECT_EQ(handed.num_maps(), kNumImages / 2);
  EXPECT_TRUE(Fuse(std::move(handed)) == Fuse({})) << "some maps from memory, the others from files";
}

}  // namespace
}  // namespace colmap_ext

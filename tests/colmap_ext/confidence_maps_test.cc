// stereo/confidence_maps: what fusion writes of each image's pixels, whoever fuses it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>

#include "colmap_ext/fusion/fusion_shards.h"
#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/pipeline/memory_scene.h"
#include "phi/base/error.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/map_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::MapWorkspaceImageName;
using test_support::ReadBytes;
using testing::HasSubstr;

constexpr int kWidth = 80, kHeight = 60, kNumViews = 9;

// Files below stereo/confidence_maps, with their bytes.
using Maps = std::map<std::string, std::string>;

class ConfidenceMaps : public ::testing::Test {
 protected:
  void SetUp() override {
    test_support::WriteMapWorkspace(
        test_support::SphereScene({.width = kWidth, .height = kHeight, .focal = 75, .num_views = kNumViews}), folder_.path());
    options_.write_confidence_maps = true;
    options_.max_neighbors = 2;
    options_.max_part_images = 2;
    options_.scratch_folder = folder_.path();
    // Holes of another shape in each image.
    for (int view = 0; view < kNumViews; ++view) {
      phi::Array2D<float> depth = ReadDepthMap(DepthPath(view));
      for (int y = 20; y < 20 + view; ++y) std::fill_n(&depth(10 + view, y), 30, 0.0f);
      for (int x = 0; x < kWidth; x += 5 + view) depth(x, 50) *= 1.1f;  // and wrong pixels
      WriteDepthMap(DepthPath(view), depth);
    }
  }

  fs::path MapsFolder() const { return folder_ / "stereo/confidence_maps"; }
  fs::path DepthPath(int view) const { return folder_ / "stereo/depth_maps" / (MapWorkspaceImageName(view) + ".geometric.bin"); }
  fs::path MapPath(int view) const { return MapsFolder() / (MapWorkspaceImageName(view) + ".geometric.bin"); }

  // Cloud and views.
  std::string Fuse(bool join = false) const {
    const Workspace workspace({.path = folder_.path()});
    const auto writer = MakePlyCloudWriter({.path = folder_ / "fused.ply"});
    if (join) {
      JoinParts(workspace, options_, parts_, writer.get());
    } else {
      FuseScene(workspace, options_, writer.get());
    }
    writer->Commit();
    return ReadBytes(folder_ / "fused.ply") + ReadBytes(folder_ / "fused.ply.vis");
  }
  int FuseShard(int index, int count) const {
    return colmap_ext::FuseShard(Workspace({.path = folder_.path()}), options_, parts_,
                                 {.index = index, .count = count, .only_stage = {}})
        .num_waiting;
  }

  Maps ReadMaps() const {
    Maps maps;
    if (!fs::exists(MapsFolder())) return maps;
    for (const auto& file : fs::recursive_directory_iterator(MapsFolder()))
      if (file.is_regular_file()) maps[file.path().filename().string()] = ReadBytes(file.path());
    return maps;
  }
  Maps TakeMaps() const {
    const Maps maps = ReadMaps();
    fs::remove_all(MapsFolder());
    return maps;
  }

  test_support::TemporaryFolder folder_;
  const fs::path parts_ = folder_ / "fused.ply.parts";
  SceneFusionOptions options_;
};

TEST_F(ConfidenceMaps, AreColmapsMapsOfTheDepthMapsSizeAndZeroWithoutDepth) {
  Fuse();
  ASSERT_EQ(ReadMaps().size(), std::size_t{kNumViews});
  const std::string header = "80&60&1&";
  for (int view = 0; view < kNumViews; ++view) {
    const std::string bytes = ReadBytes(MapPath(view));
    ASSERT_EQ(bytes.size(), header.size() + sizeof(float) * kWidth * kHeight);
    EXPECT_EQ(bytes.substr(0, header.size()), header);
    const phi::Array2D<float> depth = ReadDepthMap(DepthPath(view));
    for (std::size_t i = 0; i < depth.size(); ++i) {
      float value = 0;
      std::memcpy(&value, bytes.data() + header.size() + sizeof(float) * i, sizeof(float));
      ASSERT_EQ(value > 0, depth.data()[i] > 0) << "view " << view << ", pixel " << i;
      ASSERT_LT(value, 1);
    }
  }
}

TEST_F(ConfidenceMaps, AreWrittenOnRequestAndLeaveTheCloudAsItIs) {
  const std::string cloud = Fuse();
  TakeMaps();
  options_.write_confidence_maps = false;
  EXPECT_TRUE(Fuse() == cloud);
  EXPECT_FALSE(fs::exists(MapsFolder()));
}

TEST_F(ConfidenceMaps, AreTheSameForAnyThreadsAndMemory) {
  Fuse();
  const Maps expected = TakeMaps();
  for (const int threads : {1, 3}) {
    for (const double gigabytes : {0.0004, 0.0}) {
      options_.num_threads = threads;
      options_.max_memory_gb = gigabytes;
      Fuse();
      EXPECT_TRUE(TakeMaps() == expected) << threads << " threads, " << gigabytes << " GB";
    }
  }
}

TEST_F(ConfidenceMaps, MaskedPixelsHaveNone) {
  options_.input.mask_path = folder_ / "masks";
  phi::Mask mask(kWidth, kHeight, 255);
  std::fill_n(&mask(0, 30), kWidth, std::uint8_t{0});
  WriteGrayImage(options_.input.mask_path / (MapWorkspaceImageName(4) + ".png"), mask);
  Fuse();
  const phi::Array2D<float> map = ReadDepthMap(MapPath(4));
  for (int x = 0; x < kWidth; ++x) {
    ASSERT_EQ(map(x, 30), 0);
    ASSERT_GT(map(x, 40), 0);
  }
}

TEST_F(ConfidenceMaps, ShardsWriteTheBytesOfOneProcess) {
  Fuse();
  const Maps expected = TakeMaps();
  for (const int count : {1, 3}) {
    int rounds = 0;
    for (int num_waiting = 1; num_waiting > 0 && rounds < 20; ++rounds) {
      num_waiting = 0;
      for (int k = count - 1; k >= 0; --k) num_waiting += FuseShard(k, count);
    }
    EXPECT_TRUE(ReadMaps() == expected) << count << " shards";
    Fuse(/*join=*/true);
    EXPECT_TRUE(TakeMaps() == expected) << count << " shards, joined";
    RemoveParts(parts_);
  }
}

TEST_F(ConfidenceMaps, PartsWhoseMapsAreGoneOrAnothersAreMadeAgain) {
  const std::string cloud = Fuse();
  const Maps expected = TakeMaps();
  FuseShard(0, 1);
  fs::remove(MapPath(3));
  WriteDepthMap(MapPath(6), phi::Array2D<float>(kWidth, kHeight, 0.5f));
  EXPECT_TRUE(Fuse(/*join=*/true) == cloud);
  EXPECT_TRUE(TakeMaps() == expected);
  RemoveParts(parts_);
  // Parts that were made without them.
  options_.write_confidence_maps = false;
  FuseShard(0, 1);
  options_.write_confidence_maps = true;
  EXPECT_TRUE(Fuse(/*join=*/true) == cloud);
  EXPECT_TRUE(ReadMaps() == expected);
}

TEST_F(ConfidenceMaps, ADamagedImageGetsNone) {
  test_support::WriteBytes(folder_ / "images" / MapWorkspaceImageName(3), "no picture");
  Fuse();
  const Maps maps = ReadMaps();
  EXPECT_EQ(maps.size(), std::size_t{kNumViews - 1});
  EXPECT_FALSE(maps.contains(MapPath(3).filename().string()));
}

TEST_F(ConfidenceMaps, AFullDiskLeavesNoHalf) {
  Fuse();
  const Maps before = ReadMaps();
  options_.max_neighbors = 4;  // other values
  {
    const test_support::FileSizeLimit limit(sizeof(float) * kWidth * kHeight / 2);
    EXPECT_THROW(Fuse(), phi::ResourceError);
  }
  EXPECT_TRUE(ReadMaps() == before);
  Fuse();
  EXPECT_FALSE(ReadMaps() == before) << "the values are the same: nothing is tested";
}

TEST_F(ConfidenceMaps, RefusesWhatCannotHaveThem) {
  SceneFusionOptions paper = options_, small = options_;
  paper.rule.method.formulas = phi::Formulas::kPaper;
  EXPECT_THAT(paper.Check(), HasSubstr("--PhiFusion.write_confidence_maps: with --PhiFusion.formulas paper"));
  small.input.downsize = true;
  EXPECT_THAT(small.Check(), HasSubstr("--StereoFusion.max_image_size"));
  EXPECT_EQ(options_.Check(), "");
  EXPECT_THROW(FuseSceneMaps(Workspace({.path = folder_.path()}), {}, options_), phi::UsageError);
}

}  // namespace
}  // namespace colmap_ext

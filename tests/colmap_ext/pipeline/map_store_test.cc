#include "colmap_ext/pipeline/map_store.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

class MapStoreTest : public ::testing::Test {
 protected:
  MapStoreTest() {
    test_support::WriteNoiseWorkspace(folder_.path(), {.num_images = 2});
    workspace_.emplace(WorkspaceOptions{.path = folder_.path()});
    store_.emplace(*workspace_, 1 << 20, 1);
  }

  // Depth and normal map of the first image, as a finished result's record has them.
  TaskRecord WriteMaps() {
    const fs::path depth = workspace_->DepthMapPath(0, kind_), normal = workspace_->NormalMapPath(0, kind_);
    WritePlaneMap(depth, normal, phi::PlaneMap(24, 16, {{0, 0, -1}, 2}));
    TaskRecord record;
    record.state = "done";
    record.files = {IdentifyFile(depth), IdentifyFile(normal)};
    return record;
  }

  fs::path WriteFilledMask(std::uint8_t value) {
    const fs::path path = workspace_->FilledMaskPath(0, kind_);
    WriteMask(path, phi::Mask(24, 16, value));
    return path;
  }

  FoundFiles InspectMaps(const TaskRecord& record) const {
    return store_->Inspect(0, kind_, false, false, &record);
  }

  test_support::TemporaryFolder folder_;
  std::optional<Workspace> workspace_;
  std::optional<MapStore> store_;
  const std::string kind_{kGeometric};
};

TEST_F(MapStoreTest, MapsWithoutAMaskAreWholeWhereNoneLies) {
  const FoundFiles found = InspectMaps(WriteMaps());
  EXPECT_TRUE(found.whole);
  EXPECT_TRUE(found.foreign.empty());
}

TEST_F(MapStoreTest, WhatRegionsTellAndChooseIsFoundOnceForAllThatAsk) {
  std::atomic<int> num_found{0};
  const auto with_regions = [&](std::size_t n) {
    return [&num_found, n] {
      ++num_found;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      phi::ViewRegions told;
      told.regions.resize(n);
      return told;
    };
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] { EXPECT_EQ(store_->ToldRegions(0, with_regions(3))->regions.size(), 3u); });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_found, 1);
  EXPECT_THROW(store_->Choice(0, []() -> phi::ViewChoice { throw std::runtime_error("no"); }), std::runtime_error);
  EXPECT_TRUE(store_->Choice(0, [] { return phi::ViewChoice(); })->fitted.regions.empty()) << "a failure is not kept";
  store_->ForgetRegions(0);
  EXPECT_EQ(store_->ToldRegions(0, with_regions(4))->regions.size(), 4u);
  EXPECT_EQ(num_found, 2);
}

// A megabyte in all, of which they have a quarter.
TEST_F(MapStoreTest, WhatRegionsTellTakesAPartOfTheBudget) {
  const auto find = [&](int image, std::size_t n) {
    return store_->ToldRegions(image, [n] {
      phi::ViewRegions told;
      told.label = phi::Array2D<std::int32_t>(1000, 50);
      told.regions.resize(n);
      return told;
    })->regions.size();
  };
  EXPECT_EQ(find(0, 1), 1u);
  EXPECT_EQ(find(0, 2), 1u) << "200 kB are kept";
  EXPECT_EQ(find(1, 3), 3u);
  EXPECT_EQ(find(0, 4), 4u) << "400 kB are not";
  EXPECT_LE(store_->peak_bytes(), 1 << 20);
}

// A run that was killed after it had given new maps their names, and before it took the earlier ones' mask away.
TEST_F(MapStoreTest, AMaskOfAnEarlierResultMakesMapsThatHaveNoneBeMadeAgain) {
  TaskRecord record = WriteMaps();
  record.earlier = {IdentifyFile(WriteFilledMask(255))};
  const FoundFiles found = InspectMaps(record);
  EXPECT_FALSE(found.whole);
  EXPECT_TRUE(found.foreign.empty());
}

TEST_F(MapStoreTest, AMaskThatNoResultHadIsAnotherPrograms) {
  const TaskRecord record = WriteMaps();
  const fs::path mask = WriteFilledMask(255);
  const FoundFiles found = InspectMaps(record);
  EXPECT_FALSE(found.whole);
  EXPECT_EQ(found.foreign, mask);
  EXPECT_TRUE(store_->MapsAreOurs(0, kind_, record)) << "the maps are, whatever lies beside them";
}

}  // namespace
}  // namespace colmap_ext

#include "colmap_ext/pipeline/map_store.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

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

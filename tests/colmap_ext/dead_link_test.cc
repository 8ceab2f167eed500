#include "colmap_ext/dead_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "colmap_ext/workspace_check.h"
#include "tests/support/error_message.h"
#include "tests/support/small_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::InputErrorOf;
using test_support::TemporaryFolder;
using ::testing::ElementsAre;

const std::string kDead = "is a link to /gone/disk, which cannot be reached; mount or restore that";

TEST(DeadLink, IsToldOfAPathAndOfTheFoldersThatItLiesIn) {
  const TemporaryFolder folder;
  fs::create_symlink("/gone/disk", folder / "maps");
  fs::create_symlink("maps", folder / "b");
  fs::create_directory(folder / "there");
  fs::create_symlink("there", folder / "a");
  EXPECT_EQ(DescribeDeadLink(folder / "maps"), "'maps' " + kDead);
  EXPECT_EQ(DescribeDeadLink(folder / "maps/sub/a.bin"), "'maps' " + kDead);
  EXPECT_EQ(DescribeDeadLink(folder / "b"),
            "'b' is a link to maps, which cannot be reached; mount or restore that");
  for (const char* alive : {"a", "a/nothing", "nothing", "."})
    EXPECT_EQ(DescribeDeadLink(folder / alive), "") << alive;
  EXPECT_EQ(DescribeDeadLink("nothing"), "");
  EXPECT_EQ(DescribeDeadLink("/"), "");
}

// The first image was estimated, and then its map could not be written: "cannot create the folder: File exists".
TEST(DeadLink, OfMapsIsAnErrorBeforeAnythingIsComputed) {
  const TemporaryFolder folder;
  test_support::WriteSmallWorkspace(folder.path());
  fs::create_symlink("/gone/disk", folder / "stereo/depth_maps");
  const std::string message = (folder / "stereo/depth_maps").string() + ": 'depth_maps' " + kDead;
  EXPECT_EQ(InputErrorOf([&] { WorkspaceLock lock(folder / "stereo"); }), message);
  EXPECT_THAT(CheckWorkspace({.path = folder.path()}).errors, ElementsAre(message));
  EXPECT_EQ(InputErrorOf([&] { WriteFileAtomically(folder / "stereo/depth_maps/a.bin", "x"); }),
            (folder / "stereo/depth_maps/a.bin").string() + ": 'depth_maps' " + kDead);
}

TEST(DeadLink, OfTheFoldersOfAWorkspaceIsNoMissingFolder) {
  const TemporaryFolder folder;
  for (const char* name : {"sparse", "stereo"}) {
    test_support::WriteSmallWorkspace(folder.path());
    fs::remove_all(folder / name);
    fs::create_symlink("/gone/disk", folder / name);
    EXPECT_THAT(CheckWorkspace({.path = folder.path()}).errors,
                ::testing::Contains(::testing::EndsWith(": '" + std::string(name) + "' " + kDead)));
    fs::remove(folder / name);
  }
}

}  // namespace
}  // namespace colmap_ext

#include "colmap_ext/folder_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "phi/base/log.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class FilesBelowTest : public ::testing::Test {
 protected:
  FilesBelowTest() {
    WriteBytes(folder_ / "a/2.png", "");
    WriteBytes(folder_ / "1.png", "");
    WriteBytes(folder_ / "a/.hidden", "");
    WriteBytes(folder_ / ".folder/3.png", "");
  }

  const TemporaryFolder folder_, other_disk_;
};

TEST_F(FilesBelowTest, AreSortedAndHiddenOnesLeftOut) {
  EXPECT_THAT(FilesBelow(folder_.path()), ElementsAre("1.png", "a/2.png"));
  EXPECT_THAT(FilesBelow(folder_.path(), HiddenFiles::kIncluded),
              ElementsAre(".folder/3.png", "1.png", "a/.hidden", "a/2.png"));
  EXPECT_TRUE(FilesBelow(folder_ / "nowhere").empty());
}

// The folder itself, one below it and a file.
TEST_F(FilesBelowTest, LinksAreFollowed) {
  WriteBytes(other_disk_ / "x/y/4.png", "");
  WriteBytes(other_disk_ / "5.png", "");
  fs::create_directory_symlink(other_disk_ / "x", folder_ / "b");
  fs::create_directory_symlink(other_disk_ / "x", folder_ / "c");
  fs::create_symlink(other_disk_ / "5.png", folder_ / "link.png");
  fs::create_symlink(other_disk_ / "none.png", folder_ / "to nowhere.png");
  fs::create_directory_symlink(folder_.path(), other_disk_ / "in");
  EXPECT_THAT(FilesBelow(other_disk_ / "in"),
              ElementsAre("1.png", "a/2.png", "b/y/4.png", "c/y/4.png", "link.png"));
}

TEST_F(FilesBelowTest, LinksInACircleEnd) {
  fs::create_directory_symlink("..", folder_ / "a/up");
  fs::create_directory_symlink("self", folder_ / "self");
  fs::create_directory_symlink(other_disk_.path(), folder_ / "out");
  fs::create_directory_symlink(folder_.path(), other_disk_ / "back");
  EXPECT_THAT(FilesBelow(folder_.path()), ElementsAre("1.png", "a/2.png"));
}

TEST_F(FilesBelowTest, AFolderThatCannotBeReadIsTold) {
  const fs::path closed = folder_ / "a";
  std::vector<std::string> warnings;
  phi::SetLogSink([&](phi::LogLevel, const std::string& message) { warnings.push_back(message); });
  fs::permissions(folder_.path(), fs::perms::all);
  fs::permissions(closed, fs::perms::none);
  const bool is_root = ::geteuid() == 0;  // who could read it
  ASSERT_TRUE(!is_root || ::seteuid(65534) == 0);
  const std::vector<fs::path> files = FilesBelow(folder_.path());
  ASSERT_TRUE(!is_root || ::seteuid(0) == 0);
  fs::permissions(closed, fs::perms::owner_all);
  phi::SetLogSink(nullptr);
  EXPECT_THAT(files, ElementsAre("1.png"));
  EXPECT_THAT(warnings, ElementsAre(HasSubstr(closed.string() + ": this folder is left out")));
}

}  // namespace
}  // namespace colmap_ext

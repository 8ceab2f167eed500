#include "colmap_ext/pipeline/file_identity.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "phi/base/error.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::TemporaryFolder;
using test_support::WriteBytes;

// Later by an hour: whoever wrote it did so at another time.
void Touch(const fs::path& path) {
  fs::last_write_time(path, fs::last_write_time(path) + std::chrono::hours(1));
}

TEST(FileIdentityTest, SurvivesARenameACopyAndText) {
  const TemporaryFolder folder;
  WriteBytes(folder / "a", std::string(300000, 'a'));
  const FileIdentity identity = IdentifyFile(folder / "a");
  EXPECT_EQ(identity.num_bytes, 300000);
  fs::rename(folder / "a", folder / "b");
  EXPECT_TRUE(IsOneOf(folder / "b", {FileIdentity::FromText(identity.Text())}));
  Touch(folder / "b");
  EXPECT_TRUE(IsOneOf(folder / "b", {{5, 5, "other"}, identity}));
  EXPECT_FALSE(IsOneOf(folder / "a", {identity})) << "no file";
  EXPECT_FALSE(IsOneOf(folder / "b", {}));
  EXPECT_THROW(FileIdentity::FromText("12"), phi::InputError);
  EXPECT_THROW(IdentifyFile(folder / "a"), phi::InputError);
}

TEST(FileIdentityTest, ToldFromOthersBySizeAndBytes) {
  const TemporaryFolder folder;
  WriteBytes(folder / "a", std::string(300000, 'a'));
  const FileIdentity identity = IdentifyFile(folder / "a");
  for (const std::string& other :
       {std::string(300001, 'a'), std::string(300000, 'b'), std::string(299999, 'a') + "b"}) {
    WriteBytes(folder / "a", other);
    Touch(folder / "a");
    EXPECT_FALSE(IsOneOf(folder / "a", {identity})) << other.size() << other.back();
  }
  fs::remove(folder / "a");
  fs::create_directory(folder / "a");
  EXPECT_FALSE(IsOneOf(folder / "a", {identity}));
}

}  // namespace
}  // namespace colmap_ext

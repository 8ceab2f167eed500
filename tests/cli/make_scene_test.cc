// The commands make_scene and map_inspector as a user runs them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using test_support::ProgramResult;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using testing::HasSubstr;

ProgramResult MakeScene(const std::filesystem::path& folder) {
  return RunProgram({PHIMVS_BINARY, "make_scene", "--output_path", folder.string(), "--width", "96",
                     "--height", "72", "--num_views", "3"});
}

TEST(MakeScene, SameSeedSameFilesAndNothingIsOverwritten) {
  const TemporaryFolder folder;
  ASSERT_EQ(MakeScene(folder / "a").exit_code, 0);
  ASSERT_EQ(MakeScene(folder / "b").exit_code, 0);
  for (const char* file :
       {"dense/images/room0002.jpg", "dense/sparse/points3D.bin", "dense/sparse/images.bin",
        "truth/depth_maps/room0000.jpg.bin", "truth/normal_maps/room0000.jpg.bin"}) {
    const std::string bytes = test_support::ReadBytes(folder / "a" / file);
    EXPECT_FALSE(bytes.empty()) << file;
    EXPECT_EQ(bytes, test_support::ReadBytes(folder / "b" / file)) << file;
  }
  const ProgramResult again = MakeScene(folder / "a");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.errors, HasSubstr("choose another --output_path"));
}

TEST(MakeScene, BadOptionIsAUsageError) {
  const TemporaryFolder folder;
  const ProgramResult result = RunProgram(
      {PHIMVS_BINARY, "make_scene", "--output_path", (folder / "a").string(), "--texture_share", "2"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("--texture_share is 2; it must be from 0 to 1"));
}

TEST(MapInspector, ComparesAFolderOfMapsWithTheTruth) {
  const TemporaryFolder folder;
  phi::Array2D<float> truth(10, 10, 4.0f), depth(10, 10, 4.0f);
  for (int i = 0; i < 25; ++i) depth.data()[i] = 0;              // not kept
  for (int i = 25; i < 40; ++i) depth.data()[i] = 4.0f * 1.02f;  // 2 % off: 15 of 75
  colmap_ext::WriteDepthMap(folder / "maps/sub/a.jpg.geometric.bin", depth);
  colmap_ext::WriteDepthMap(folder / "maps/sub/a.jpg.photometric.bin", truth);
  colmap_ext::WriteDepthMap(folder / "truth/sub/a.jpg.bin", truth);
  const ProgramResult result =
      RunProgram({PHIMVS_BINARY, "map_inspector", "--input_path", (folder / "maps").string(), "--truth_path",
                  (folder / "truth").string(), "--output_path", (folder / "pictures").string()});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("valid 75.0 %"));
  EXPECT_THAT(result.output,
              testing::EndsWith("accuracy: kept 75.0 % of pixels, 80.0 % of them within 1 %\n"));
  const auto picture = colmap_ext::ReadColorImage(folder / "pictures/sub/a.jpg.geometric.png");
  EXPECT_EQ(picture.width(), 26) << "map, gap, truth";
  EXPECT_EQ(picture(0, 0), (colmap_ext::Rgb{0, 0, 0})) << "no depth is black";
}

TEST(MapInspector, ShowsTheOtherMapsBesideADamagedOne) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "b", "c"}) {
    colmap_ext::WriteDepthMap(folder / (std::string(name) + ".jpg.geometric.bin"),
                              phi::Array2D<float>(10, 10, 4.0f));
  }
  std::filesystem::resize_file(folder / "b.jpg.geometric.bin", 100);
  const ProgramResult result =
      RunProgram({PHIMVS_BINARY, "map_inspector", "--input_path", folder.path().string(), "--output_path",
                  (folder / "pictures").string()});
  EXPECT_EQ(result.exit_code, 4) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("b.jpg.geometric.bin"));
  EXPECT_THAT(result.errors, HasSubstr("1 of 3 maps could not be shown"));
  EXPECT_TRUE(std::filesystem::exists(folder / "pictures/a.jpg.geometric.png"));
  EXPECT_FALSE(std::filesystem::exists(folder / "pictures/b.jpg.geometric.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "pictures/c.jpg.geometric.png"));
}

TEST(MapInspector, ShowsASingleNormalMapAndNamesWhatIsMissing) {
  const TemporaryFolder folder;
  colmap_ext::WriteNormalMap(folder / "n.bin", phi::Array2D<phi::Vec3f>(4, 3, phi::Vec3f{0, 0, -1}));
  const ProgramResult result =
      RunProgram({PHIMVS_BINARY, "map_inspector", "--input_path", (folder / "n.bin").string(),
                  "--output_path", (folder / "n.png").string()});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(colmap_ext::ReadColorImage(folder / "n.png")(1, 1), (colmap_ext::Rgb{128, 128, 255}));

  const ProgramResult missing =
      RunProgram({PHIMVS_BINARY, "map_inspector", "--input_path", folder.path().string()});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.errors, HasSubstr("holds no <image>.geometric.bin"));
}

}  // namespace

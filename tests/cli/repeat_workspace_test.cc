#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "colmap_ext/sparse_model.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using colmap_ext::SparseModel;
using test_support::ProgramResult;
using test_support::RunProgram;

ProgramResult Repeat(const fs::path& source, const fs::path& target, const std::string& copies) {
  return RunProgram({"python3", PHIMVS_SOURCE_DIR "/scripts/repeat_workspace", "--workspace_path", source, "--output_path",
                     target, "--copies", copies},
                    {"PYTHONDONTWRITEBYTECODE=1"});
}

// Two images see a point. Copied twice, each copy's images see one of their own.
TEST(RepeatWorkspace, ACopySharesPointsWithItsOwnImagesAlone) {
  const test_support::TemporaryFolder folder;
  SparseModel model;
  model.cameras[7] = {7, 1, 40, 30, {20, 20, 20, 15}};
  colmap_ext::SparsePoint point;
  point.point3D_id = 5;
  for (const std::uint32_t id : {3u, 9u}) {
    colmap_ext::SparseImage image;
    image.image_id = id;
    image.camera_id = 7;
    image.name = std::to_string(id) + ".png";
    image.observations = {{1, 2, 5}};
    model.images.push_back(image);
    point.track.push_back({id, 0});
    test_support::WriteBytes(folder / "dense/images" / image.name, "pixels of " + image.name);
  }
  model.points.push_back(point);
  fs::create_directories(folder / "dense/sparse");
  WriteSparseModelBinary(model, folder / "dense/sparse");

  const ProgramResult result = Repeat(folder / "dense", folder / "big", "3");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const SparseModel big = colmap_ext::ReadSparseModel(folder / "big/sparse");
  ASSERT_EQ(big.images.size(), 6u);
  ASSERT_EQ(big.points.size(), 3u);
  std::set<std::uint32_t> ids;
  for (const auto& image : big.images) {
    ids.insert(image.image_id);
    EXPECT_EQ(test_support::ReadBytes(folder / "big/images" / image.name),
              "pixels of " + fs::path(image.name).filename().string());
  }
  EXPECT_EQ(ids.size(), 6u);
  for (const auto& copied : big.points) {
    std::set<std::string> folders;
    for (const auto& element : copied.track) {
      for (const auto& image : big.images) {
        if (image.image_id != element.image_id) continue;
        folders.insert(fs::path(image.name).parent_path().string());
        EXPECT_EQ(image.observations[element.observation_index].point3D_id, copied.point3D_id);
      }
    }
    EXPECT_EQ(copied.track.size(), 2u);
    EXPECT_EQ(folders.size(), 1u);
  }
  EXPECT_NE(Repeat(folder / "dense", folder / "big", "3").exit_code, 0) << "what is there stays";
}

}  // namespace

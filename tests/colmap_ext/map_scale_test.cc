// Maps in another unit than the sparse model's are told of, whoever made them.
#include "colmap_ext/map_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>

#include "colmap_ext/map_file.h"
#include "colmap_ext/patch_match_config.h"
#include "colmap_ext/sparse_model.h"
#include "colmap_ext/workspace_check.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/map_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using test_support::ProgramResult;
using test_support::RunProgram;

class MapScaleTest : public ::testing::Test {
 protected:
  MapScaleTest() { WriteMaps(); }

  void WriteMaps() const {
    static const RenderedScene scene = test_support::SphereScene();
    test_support::WriteMapWorkspace(scene, folder_.path());
  }

  Workspace Open() const { return Workspace(WorkspaceOptions{folder_.path()}); }
  std::string Warning() const { return MapScaleWarning(Open(), {kGeometric}); }
  // depth(x, y, depth) is the new one.
  void ChangeMaps(const std::function<float(int, int, float)>& depth) {
    const Workspace workspace = Open();
    for (int image = 0; image < static_cast<int>(workspace.views().size()); ++image) {
      phi::DepthMap map = ReadDepthMap(workspace.DepthMapPath(image, kGeometric));
      for (int y = 0; y < map.height(); ++y) {
        for (int x = 0; x < map.width(); ++x) map(x, y) = depth(x, y, map(x, y));
      }
      WriteDepthMap(workspace.DepthMapPath(image, kGeometric), map);
    }
  }
  void ScaleMaps(float factor) {
    ChangeMaps([=](int, int, float depth) { return factor * depth; });
  }
  ProgramResult Run(const std::string& command, std::vector<std::string> options) const {
    std::vector<std::string> line = {PHIMVS_BINARY, command, "--workspace_path", folder_.path().string()};
    line.insert(line.end(), options.begin(), options.end());
    return RunProgram(line);
  }

  test_support::TemporaryFolder folder_;
};

TEST_F(MapScaleTest, MapsOfTheModelAreNotToldOf) {
  EXPECT_EQ(Warning(), "");
  ScaleMaps(1.2f);
  EXPECT_EQ(Warning(), "");
  EXPECT_TRUE(MapScaleWarning(Open(), {kMeasured}).empty()) << "there are none";
}

TEST_F(MapScaleTest, MillimetresForMetresAreToldWithTheirFactor) {
  ScaleMaps(1000);
  EXPECT_THAT(Warning(), AllOf(HasSubstr("view 0.png.geometric.bin"), HasSubstr("they are 1000 times the points' depths"),
                               HasSubstr("multiply the maps by about 0.001,")));
  ScaleMaps(0.001f * 0.79f);
  EXPECT_THAT(Warning(), HasSubstr("0.79 times"));
  EXPECT_THAT(MapScaleWarning(Open(), {kMeasured, kGeometric}).text, HasSubstr("0.79 times"));
}

// Nor are maps of another model told of: neither has one factor.
TEST_F(MapScaleTest, NoiseIsNoUnit) {
  ChangeMaps([](int x, int y, float depth) { return depth * static_cast<float>(2 + (7 * x + 3 * y) % 11); });
  EXPECT_EQ(Warning(), "");
}

TEST_F(MapScaleTest, FewPointsAndDamagedMapsTellNothing) {
  ScaleMaps(1000);
  SparseModel model = ReadSparseModel(folder_ / "sparse");
  for (std::size_t i = 0; i < model.images.size(); ++i)
    test_support::WriteBytes(Open().DepthMapPath(static_cast<int>(i), kGeometric), "damaged");
  EXPECT_EQ(Warning(), "");
  WriteMaps();
  ScaleMaps(1000);
  model.points.resize(49 / model.images.size());
  for (SparseImage& image : model.images) {
    for (Observation& seen : image.observations) {
      if (seen.point3D_id > model.points.size()) seen.point3D_id = kInvalidPoint3D;
    }
  }
  WriteSparseModelBinary(model, folder_ / "sparse");
  EXPECT_EQ(Warning(), "");
}

TEST_F(MapScaleTest, CommandsSaySoAndGoOn) {
  ScaleMaps(1000);
  WritePatchMatchConfig(folder_ / "stereo/patch-match.cfg", {"view 0.png", "view 1.png"}, 20);
  const auto says_so = HasSubstr("they are 1000 times the points' depths");
  const ProgramResult fusion = Run("stereo_fusion", {"--output_path", (folder_ / "fused.ply").string()});
  EXPECT_EQ(fusion.exit_code, 0);
  EXPECT_THAT(fusion.errors, says_so);
  EXPECT_TRUE(fs::exists(folder_ / "fused.ply"));
  const ProgramResult filling = Run("hole_filler", {"--overwrite", "true", "--PhiStereo.backend", "cpu"});
  EXPECT_EQ(filling.exit_code, 0) << filling.errors;
  EXPECT_THAT(filling.errors, says_so);
  EXPECT_THAT(CheckWorkspace({.path = folder_.path()}, {}, {}).warnings, Contains(says_so));
}

}  // namespace
}  // namespace colmap_ext

// The room's files: our reader, and COLMAP's, find in them what was rendered.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "colmap_ext/fusion_config.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/patch_match_config.h"
#include "colmap_ext/synthetic/room.h"
#include "colmap_ext/workspace.h"
#include "phi/base/error.h"

namespace {

namespace fs = std::filesystem;
using colmap_ext::SyntheticRoom;

class RoomWriterTest : public testing::Test {
 protected:
  RoomWriterTest() {
    colmap_ext::SyntheticRoomOptions options;
    options.width = 128;
    options.height = 96;
    options.num_views = 4;
    options.supersampling = 2;
    room_ = MakeSyntheticRoom(options);
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("phimvs_room_") + test->name());
    fs::remove_all(folder_);
    colmap_ext::WriteSyntheticRoom(room_, folder_);
  }
  ~RoomWriterTest() override { fs::remove_all(folder_); }

  SyntheticRoom room_;
  fs::path folder_;
};

TEST_F(RoomWriterTest, OurReaderFindsWhatWasRendered) {
  colmap_ext::WorkspaceOptions options;
  options.path = folder_ / "dense";
  const colmap_ext::Workspace workspace(options);
  ASSERT_EQ(workspace.views().size(), 4u);
  for (int i = 0; i < 4; ++i) {
    const phi::SceneView& read = workspace.views()[i];
    const phi::SceneView& rendered = room_.scene.views[i];
    EXPECT_EQ(read.name, rendered.name);
    EXPECT_EQ(read.image_id, rendered.image_id);
    EXPECT_EQ(read.camera.pinhole.fx, rendered.camera.pinhole.fx);
    EXPECT_EQ(read.camera.pinhole.cy, rendered.camera.pinhole.cy);
    EXPECT_TRUE(read.camera.pose.rotation.isApprox(rendered.camera.pose.rotation, 1e-12));
    EXPECT_TRUE(read.camera.pose.translation.isApprox(rendered.camera.pose.translation, 1e-12));
    const auto gray = workspace.ReadGray(i);
    EXPECT_TRUE(std::equal(gray->begin(), gray->end(), room_.scene.images[i]->begin()));
  }
  EXPECT_EQ(workspace.model().points.size(), room_.model.points.size());
  EXPECT_EQ(ReadPatchMatchConfig(workspace).at(2).max_automatic_sources, 20);
  EXPECT_EQ(ReadFusionConfig(workspace).size(), 4u);
}

TEST_F(RoomWriterTest, TruthIsReadBackExactly) {
  const phi::PlaneMap map = colmap_ext::ReadPlaneMap(folder_ / "truth/depth_maps/room0001.jpg.bin",
                                                     folder_ / "truth/normal_maps/room0001.jpg.bin");
  const phi::PlaneMap& truth = *room_.scene.truth[1];
  ASSERT_EQ(map.size(), truth.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    ASSERT_EQ(map.data()[i].depth, truth.data()[i].depth);
    ASSERT_EQ(map.data()[i].normal.x, truth.data()[i].normal.x);
  }
  const phi::Mask mask = colmap_ext::ReadMask(folder_ / "truth/textured_masks/room0001.jpg.png");
  EXPECT_TRUE(std::equal(mask.begin(), mask.end(), room_.scene.textured[1]->begin()));
}

TEST_F(RoomWriterTest, RefusesToWriteIntoAnExistingWorkspace) {
  EXPECT_THROW(colmap_ext::WriteSyntheticRoom(room_, folder_), phi::InputError);
}

TEST_F(RoomWriterTest, PycolmapReadsTheModel) {
  if (std::system("python3 -c 'import pycolmap' >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "python3 has no pycolmap";
  const fs::path output = folder_ / "pycolmap.txt";
  const std::string script =
      "import pycolmap, sys\n"
      "r = pycolmap.Reconstruction(sys.argv[1])\n"
      "print(r.num_reg_images(), r.num_points3D(), r.cameras[1].model_name if hasattr(r.cameras[1], "
      "'model_name') else "
      "r.cameras[1].model.name, round(r.compute_mean_reprojection_error(), 3))\n";
  std::ofstream(folder_ / "read.py") << script;
  const std::string command = "python3 '" + (folder_ / "read.py").string() + "' '" +
                              (folder_ / "dense/sparse").string() + "' > '" + output.string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::size_t images = 0, points = 0;
  std::string model;
  double error = 0;
  std::ifstream(output) >> images >> points >> model >> error;
  EXPECT_EQ(images, 4u);
  EXPECT_EQ(points, room_.model.points.size());
  EXPECT_EQ(model, "PINHOLE");
  // Rayleigh mean of sigma 0.3 is 0.376; fitting three coordinates to at most four observations takes some
  // away.
  EXPECT_GT(error, 0.2);
  EXPECT_LT(error, 0.4);
}

}  // namespace

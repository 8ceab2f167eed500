// Our files as COLMAP and pycolmap read them, and theirs as we read them. Skipped where they are not installed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "colmap_ext/fusion_config.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/patch_match_config.h"
#include "colmap_ext/rig_frames.h"
#include "colmap_ext/workspace.h"
#include "tests/support/small_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::ExpectSameModel;
using test_support::ReadBytes;
using test_support::SmallModel;
using test_support::TemporaryFolder;
using test_support::WriteBytes;

// COLMAP normalises quaternions.
constexpr double kRotationTolerance = 1e-12;

bool Succeeds(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

// COLMAP 3.8 ends a name at its first space when it reads text.
SparseModel ModelWithPlainNames() {
  SparseModel model = SmallModel();
  model.images[1].name = "sub/b.png";
  return model;
}

// The small workspace as it was before undistortion: camera 1 is SIMPLE_RADIAL.
void WriteDistortedProject(const fs::path& folder) {
  test_support::WriteSmallWorkspace(folder);
  SparseModel model = SmallModel();
  model.cameras[1].model_id = 2;
  model.cameras[1].params = {30, 16, 12, 0.05};
  WriteSparseModelBinary(model, folder / "sparse");
  fs::remove_all(folder / "stereo");
}

void ExpectUndistortedWorkspace(const fs::path& folder) {
  const Workspace workspace({folder});
  ASSERT_EQ(workspace.views().size(), 3u);
  for (const SparseImage& image : SmallModel().images) {
    const int index = workspace.FindImage(image.name);
    ASSERT_GE(index, 0) << image.name;
    EXPECT_EQ(workspace.views()[index].image_id, image.image_id);
    const auto gray = workspace.ReadGray(index);
    EXPECT_GT(gray->width(), 10);
    EXPECT_EQ(gray->width(), workspace.views()[index].camera.pinhole.width);
  }
  const auto problems = ReadPatchMatchConfig(workspace);
  ASSERT_EQ(problems.size(), 3u);
  for (const PatchMatchProblem& problem : problems) EXPECT_EQ(problem.max_automatic_sources, 20);
  EXPECT_EQ(ReadFusionConfig(workspace).size(), 3u);
}

class PycolmapTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!Succeeds("python3 -c 'import pycolmap'"))
      GTEST_SKIP() << "python3 has no pycolmap (pip install pycolmap)";
  }
  // `a` is the test's folder.
  void RunPython(const std::string& script) {
    WriteBytes(folder_ / "script.py",
               "import pathlib, sys, pycolmap\na = pathlib.Path(sys.argv[1])\n" + script);
    const std::string command = "python3 " + (folder_ / "script.py").string() + " " +
                                folder_.path().string() + " >/dev/null 2>" + (folder_ / "errors").string();
    ASSERT_EQ(std::system(command.c_str()), 0) << ReadBytes(folder_ / "errors");
  }
  TemporaryFolder folder_;
};

constexpr const char* kPythonRewrite =
    "for name in ('binary', 'text'): (a / name).mkdir()\n"
    "model = pycolmap.Reconstruction(str(a / 'ours'))\n"
    "model.write_binary(str(a / 'binary'))\n"
    "model.write_text(str(a / 'text'))\n";

TEST_F(PycolmapTest, ReadsOurBinaryModelAndWeItsModels) {
  WriteSparseModelBinary(SmallModel(), folder_ / "ours");
  RunPython(kPythonRewrite);
  ExpectSameModel(ReadSparseModel(folder_ / "binary"), SmallModel(), kRotationTolerance);
  ExpectSameModel(ReadSparseModel(folder_ / "text"), SmallModel(), kRotationTolerance);
}

TEST_F(PycolmapTest, ReadsOurTextModelAndWeItsModels) {
  WriteSparseModelText(ModelWithPlainNames(), folder_ / "ours");
  RunPython(kPythonRewrite);
  ExpectSameModel(ReadSparseModel(folder_ / "binary"), ModelWithPlainNames(), kRotationTolerance);
  ExpectSameModel(ReadSparseModel(folder_ / "text"), ModelWithPlainNames(), kRotationTolerance);
}

// Frames of two cameras, of which the second is turned.
TEST_F(PycolmapTest, WritesFramesWhosePosesWeKnow) {
  RunPython(
      "import numpy as np\n"
      "def pose(q, t): return pycolmap.Rigid3d(pycolmap.Rotation3d(np.array(q)), np.array(t))\n"
      "model = pycolmap.Reconstruction()\n"
      "for id in (1, 2): model.add_camera(pycolmap.Camera(camera_id=id, model='PINHOLE', width=64, height=48, params=[60, 60, 32, 24]))\n"
      "rig = pycolmap.Rig(rig_id=7)\n"
      "rig.add_ref_sensor(model.cameras[1].sensor_id)\n"
      "rig.add_sensor(model.cameras[2].sensor_id, pose([0, 0, 0.6, 0.8], [0.1, 0.2, 0.3]))\n"
      "model.add_rig(rig)\n"
      "for f in (1, 2):\n"
      "    frame = pycolmap.Frame(frame_id=f, rig_id=7)\n"
      "    images = [pycolmap.Image(image_id=10 * f + c, camera_id=c, name=f'{f}/{c}.png', frame_id=f) for c in (1, 2)]\n"
      "    for image in images: frame.add_data_id(image.data_id)\n"
      "    frame.rig_from_world = pose([0.6 * (f - 1), 0, 0, 1 - 0.2 * (f - 1)], [f, 2, 3])\n"
      "    model.add_frame(frame)\n"
      "    for image in images: model.add_image(image)\n"
      "    model.register_frame(f)\n"
      "for name in ('binary', 'text'): (a / name).mkdir()\n"
      "model.write_binary(str(a / 'binary'))\n"
      "model.write_text(str(a / 'text'))\n");
  for (const char* name : {"binary", "text"}) {
    SparseModel model = ReadSparseModel(folder_ / name);
    ASSERT_EQ(model.images.size(), 4u);
    EXPECT_EQ(FramesWarning(folder_ / name, model), "");
    for (SparseImage& image : model.images) image.translation.x() += image.camera_id == 2 ? 0.01 : 0;
    EXPECT_THAT(FramesWarning(folder_ / name, model), ::testing::HasSubstr("2 of 4 images"));
  }
}

TEST_F(PycolmapTest, KnowsOurNamesOfCameraModels) {
  std::string names;
  for (int id = 0; CameraModelName(id).find("unknown") == std::string::npos; ++id) {
    names +=
        "assert pycolmap.CameraModelId." + CameraModelName(id) + ".value == " + std::to_string(id) + "\n";
  }
  RunPython(names + "assert len(pycolmap.CameraModelId.__members__) == " +
            std::to_string(std::count(names.begin(), names.end(), '\n')) +
            " + 1, 'there are new camera models'\n");
}

TEST_F(PycolmapTest, ReadsOurMapsAndWeIts) {
  phi::PlaneMap map(3, 2);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) map(x, y) = {{0.25f * x, 0.5f * y, -1}, 1.0f + x + 10 * y};
  }
  WritePlaneMap(folder_ / "depth.bin", folder_ / "normal.bin", map);
  // NormalMap.to_array() of pycolmap 4.2 hands out the channel planes under the shape of interleaved pixels, so the
  // values of normals are not looked at.
  RunPython(
      "depth, normal = pycolmap.DepthMap(), pycolmap.NormalMap()\n"
      "depth.read(str(a / 'depth.bin'))\n"
      "normal.read(str(a / 'normal.bin'))\n"
      "assert depth.to_array().tolist() == [[1, 2, 3], [11, 12, 13]], depth.to_array()\n"
      "depth.write(str(a / 'depth2.bin'))\n"
      "normal.write(str(a / 'normal2.bin'))\n");
  EXPECT_EQ(ReadBytes(folder_ / "depth2.bin"), ReadBytes(folder_ / "depth.bin"));
  EXPECT_EQ(ReadBytes(folder_ / "normal2.bin"), ReadBytes(folder_ / "normal.bin"));
}

TEST_F(PycolmapTest, UndistortsIntoAWorkspaceThatWeRead) {
  WriteDistortedProject(folder_ / "project");
  RunPython(
      "p = a / 'project'\n"
      "pycolmap.undistort_images(str(a / 'dense'), str(p / 'sparse'), str(p / 'images'),\n"
      "                          num_patch_match_src_images=20)\n");
  ExpectUndistortedWorkspace(folder_ / "dense");
}

class ColmapTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!Succeeds("colmap help")) GTEST_SKIP() << "colmap is not installed (apt-get install colmap)";
  }
  void RunColmap(const std::string& arguments) {
    ASSERT_TRUE(Succeeds("QT_QPA_PLATFORM=offscreen colmap " + arguments)) << "colmap " << arguments;
  }
  void Convert(const char* from, const char* to, const char* type) {
    fs::create_directory(folder_ / to);
    RunColmap("model_converter --input_path " + (folder_ / from).string() + " --output_path " +
              (folder_ / to).string() + " --output_type " + type);
  }
  TemporaryFolder folder_;
};

TEST_F(ColmapTest, ReadsOurBinaryModelAndWeItsModels) {
  WriteSparseModelBinary(SmallModel(), folder_ / "ours");
  Convert("ours", "binary", "BIN");
  Convert("ours", "text", "TXT");
  ExpectSameModel(ReadSparseModel(folder_ / "binary"), SmallModel(), kRotationTolerance);
  ExpectSameModel(ReadSparseModel(folder_ / "text"), SmallModel(), kRotationTolerance);
}

TEST_F(ColmapTest, ReadsOurTextModelAndWeItsModels) {
  WriteSparseModelText(ModelWithPlainNames(), folder_ / "ours");
  Convert("ours", "binary", "BIN");
  Convert("ours", "text", "TXT");
  ExpectSameModel(ReadSparseModel(folder_ / "binary"), ModelWithPlainNames(), kRotationTolerance);
  ExpectSameModel(ReadSparseModel(folder_ / "text"), ModelWithPlainNames(), kRotationTolerance);
}

TEST_F(ColmapTest, UndistortsIntoAWorkspaceThatWeRead) {
  WriteDistortedProject(folder_ / "project");
  RunColmap("image_undistorter --image_path " + (folder_ / "project/images").string() + " --input_path " +
            (folder_ / "project/sparse").string() + " --output_path " + (folder_ / "dense").string());
  ExpectUndistortedWorkspace(folder_ / "dense");
}

}  // namespace
}  // namespace colmap_ext

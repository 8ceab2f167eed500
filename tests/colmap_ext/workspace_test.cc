#include "colmap_ext/workspace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "colmap_ext/pinhole_camera.h"
#include "colmap_ext/pipeline/result_files.h"
#include "colmap_ext/workspace_folder.h"
#include "tests/support/error_message.h"
#include "tests/support/small_workspace.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_data.h"

namespace colmap_ext {
namespace {

using test_support::InputErrorOf;
using test_support::SmallModel;
using test_support::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class WorkspaceTest : public ::testing::Test {
 protected:
  WorkspaceTest() {
    options_.path = folder_.path();
    test_support::WriteSmallWorkspace(folder_.path());
  }
  void WriteModel(const SparseModel& model) { WriteSparseModelBinary(model, folder_ / "sparse"); }
  std::string OpenError() {
    return InputErrorOf([&] { Workspace workspace(options_); });
  }

  TemporaryFolder folder_;
  WorkspaceOptions options_;
};

TEST_F(WorkspaceTest, ViewsHaveTheModelsCameras) {
  const Workspace workspace(options_);
  ASSERT_EQ(workspace.views().size(), 3u);
  const phi::SceneView& b = workspace.views()[1];
  EXPECT_EQ(b.name, "sub folder/b \xC3\xA9.png");
  EXPECT_EQ(b.image_id, 3u);
  EXPECT_EQ(b.camera.pinhole.width, 32);
  EXPECT_EQ(b.camera.pinhole.height, 24);
  EXPECT_EQ(b.camera.pinhole.fx, 30);
  EXPECT_EQ(b.camera.pinhole.fy, 31);
  EXPECT_EQ(b.camera.pinhole.cx, 16);
  EXPECT_EQ(b.camera.pinhole.cy, 12);
  // Quaternion (w, x, y, z) = (1, -1, 1, -1) / 2 takes x to -y, y to -z and z to x.
  EXPECT_TRUE((b.camera.pose.rotation * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(0, -1, 0)));
  EXPECT_TRUE((b.camera.pose.rotation * Eigen::Vector3d(0, 1, 0)).isApprox(Eigen::Vector3d(0, 0, -1)));
  EXPECT_EQ(b.camera.pose.translation, Eigen::Vector3d(1, 2, 3));
  const phi::Pinhole& simple = workspace.views()[2].camera.pinhole;
  EXPECT_EQ(simple.fx, 25);
  EXPECT_EQ(simple.fy, 25);
  EXPECT_EQ(simple.cx, 10);
  EXPECT_EQ(simple.cy, 5);
}

TEST_F(WorkspaceTest, DropsObservationsAndNothingElse) {
  Workspace workspace(options_);
  workspace.DropObservations();
  const SparseModel model = SmallModel();
  ASSERT_EQ(workspace.model().images.size(), model.images.size());
  for (const SparseImage& image : workspace.model().images) EXPECT_EQ(image.observations.capacity(), 0u);
  ASSERT_EQ(workspace.model().points.size(), model.points.size());
  EXPECT_EQ(workspace.model().points[0].track.size(), model.points[0].track.size());
  EXPECT_EQ(workspace.model().cameras.size(), model.cameras.size());
}

TEST_F(WorkspaceTest, PathsFollowColmapsLayout) {
  const Workspace workspace(options_);
  const std::filesystem::path root = folder_.path();
  const std::string name = "sub folder/b \xC3\xA9.png";
  EXPECT_EQ(workspace.ImagePath(1), root / "images" / name);
  EXPECT_EQ(workspace.DepthMapPath(1, kGeometric), root / "stereo/depth_maps" / (name + ".geometric.bin"));
  EXPECT_EQ(workspace.NormalMapPath(1, kPhotometric),
            root / "stereo/normal_maps" / (name + ".photometric.bin"));
  EXPECT_EQ(workspace.CostMapPath(1, kPhotometric), root / "stereo/cost_maps" / (name + ".photometric.bin"));
  EXPECT_EQ(workspace.ConfidenceMapPath(1, kGeometric), root / "stereo/confidence_maps" / (name + ".geometric.bin"));
  EXPECT_EQ(workspace.FilledMaskPath(1), root / "stereo/filled_masks" / (name + ".png"));
  EXPECT_EQ(workspace.FindImage(name), 1);
  EXPECT_EQ(workspace.FindImage("c.png"), 2);
  EXPECT_EQ(workspace.FindImage("d.png"), -1);
}

// 1001 x 667 to at most 500: factor 500 / 1001, height 667 * 500 / 1001 = 333.17, so 333; each axis scales by its own
// rounded ratio.
TEST_F(WorkspaceTest, WorkingResolutionIsRoundedAsColmapDoes) {
  const phi::Pinhole full{1001, 667, 800, 810, 500.5, 333.5};
  const phi::Pinhole small = DownsizedPinhole(full, 500);
  EXPECT_EQ(small.width, 500);
  EXPECT_EQ(small.height, 333);
  EXPECT_DOUBLE_EQ(small.fx, 800 * 500.0 / 1001);
  EXPECT_DOUBLE_EQ(small.cx, 250);
  EXPECT_DOUBLE_EQ(small.fy, 810 * 333.0 / 667);
  EXPECT_DOUBLE_EQ(small.cy, 166.5);
  // A portrait image is bounded by its height; a small one, and no bound, leave the camera alone.
  EXPECT_EQ(DownsizedPinhole({600, 1200, 1, 1, 1, 1}, 300).width, 150);
  EXPECT_EQ(DownsizedPinhole(full, 1001).height, 667);
  EXPECT_EQ(DownsizedPinhole(full, 0).height, 667);
  EXPECT_EQ(DownsizedPinhole({100000, 10, 1, 1, 1, 1}, 100).height, 1);
}

TEST_F(WorkspaceTest, TheLargestImageIsThatOfTheWorkingResolution) {
  EXPECT_EQ(Workspace(options_).LargestImage(), 32 * 24);
  options_.max_image_size = 16;
  EXPECT_EQ(Workspace(options_).LargestImage(), 16 * 12);
}

TEST_F(WorkspaceTest, GrayImagesComeAtTheWorkingResolution) {
  options_.max_image_size = 16;
  const Workspace workspace(options_);
  const auto gray = workspace.ReadGray(0);
  ASSERT_EQ(gray->width(), 16);
  ASSERT_EQ(gray->height(), 12);
  // Pixels are 7 x + 3 y: the mean of columns 2, 3 and rows 4, 5 is 17.5 + 13.5 = 31.
  EXPECT_EQ((*gray)(1, 2), 31);
  EXPECT_EQ(Workspace({folder_.path(), "COLMAP", -1}).ReadGray(1)->width(), 32);
}

TEST_F(WorkspaceTest, ColoursComeAtTheMapsSize) {
  const Workspace workspace(options_);
  const ColorImage color = workspace.ReadColor(1, 16, 12);
  ASSERT_EQ(color.width(), 16);
  EXPECT_EQ(color(1, 2), (Rgb{31, 31, 31}));
}

TEST_F(WorkspaceTest, ImageOfAnotherSizeThanItsCameraIsAnErrorThatNamesIt) {
  const Workspace workspace(options_);
  const std::string path = (folder_ / "images/c.png").string();
  for (const bool is_turned : {false, true}) {
    WriteGrayImage(folder_ / "images/c.png", is_turned ? phi::GrayImage(10, 20) : phi::GrayImage(10, 5));
    const std::string size = std::string("is ") + (is_turned ? "10x20" : "10x5") + " pixels but its camera 4 is 20x10";
    for (const auto& message : {InputErrorOf([&] { workspace.ReadGray(2); }),
                                InputErrorOf([&] { workspace.ReadColor(2, 20, 10); })}) {
      EXPECT_THAT(message, AllOf(HasSubstr(path), HasSubstr(size)));
      EXPECT_EQ(message.find("its sides are swapped") != std::string::npos, is_turned) << message;
      EXPECT_EQ(message.find("--max_image_size") != std::string::npos, !is_turned) << message;
    }
  }
  std::filesystem::remove(folder_ / "images/c.png");
  EXPECT_THAT(InputErrorOf([&] { workspace.ReadGray(2); }), AllOf(HasSubstr(path), HasSubstr("missing")));
}

TEST_F(WorkspaceTest, RefusesDistortedCamerasByName) {
  SparseModel model = SmallModel();
  model.cameras[4].model_id = 4;
  model.cameras[4].params = {25, 25, 10, 5, 0, 0, 0, 0.1};
  WriteModel(model);
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("camera 4 is OPENCV"), HasSubstr("run colmap image_undistorter")));
  model.cameras[4] = SmallModel().cameras[4];
  model.cameras[4].params[0] = -25;
  WriteModel(model);
  EXPECT_THAT(OpenError(), HasSubstr("camera 4 has a focal length that is not positive; correct it"));
}

// f, cx and cy of a camera of 20x10 pixels. Its maps were empty, without a word of the camera.
TEST_F(WorkspaceTest, RefusesCamerasThatNoLensIs) {
  SparseModel model = SmallModel();
  const std::vector<double> impossible[] = {{1e12, 10, 5}, {1e300, 10, 5}, {1e-9, 10, 5}, {25, 1e6, 5}, {25, 10, -1e300}};
  for (const std::vector<double>& params : impossible) {
    model.cameras[4].params = params;
    WriteModel(model);
    EXPECT_THAT(OpenError(), AllOf(HasSubstr("cameras.bin: camera 4 has an impossible focal length or principal point"),
                                   HasSubstr("20x10"), HasSubstr("correct them")));
  }
  // A satellite's, a fisheye's that was undistorted to 170 degrees, and a part of a larger photo.
  const std::vector<double> possible[] = {{1e6, 10, 5}, {0.9, 10, 5}, {25, 2000, 5}};
  for (const std::vector<double>& params : possible) {
    model.cameras[4].params = params;
    WriteModel(model);
    EXPECT_EQ(Workspace(options_).views().size(), 3u);
  }
}

TEST_F(WorkspaceTest, CamerasThatNoImageUsesMayBeAnything) {
  SparseModel model = SmallModel();
  model.cameras[9] = {9, 4, 40, 30, {25, 25, 10, 5, 0, 0, 0, 0.1}};
  WriteModel(model);
  EXPECT_EQ(Workspace(options_).views().size(), 3u);
}

TEST_F(WorkspaceTest, RefusesNamesThatLeaveTheWorkspace) {
  const std::pair<const char*, const char*> names[] = {{"../x.png", "leads out of the workspace"},
                                                       {"a/../../x.png", "leads out of the workspace"},
                                                       {"/etc/x.png", "is an absolute path"},
                                                       {"a/", "ends in a slash"},
                                                       {"a\nb.png", "holds a line break"}};
  for (const auto& [name, problem] : names) {
    SparseModel model = SmallModel();
    model.images[0].name = name;
    WriteModel(model);
    EXPECT_THAT(OpenError(), AllOf(HasSubstr(name), HasSubstr(problem)));
  }
  // Binary models end their names with one, text models may hold it.
  WriteSparseModelText(SmallModel(), options_.path / "sparse");
  for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"})
    std::filesystem::remove(options_.path / "sparse" / file);
  std::string text = test_support::ReadBytes(options_.path / "sparse/images.txt");
  text.replace(text.find("a.png"), 5, std::string("a\0png", 5));
  test_support::WriteBytes(options_.path / "sparse/images.txt", text);
  EXPECT_THAT(OpenError(), HasSubstr("holds a NUL byte"));

  SparseModel model = SmallModel();
  model.images[0].name = "..a/b..png";
  WriteModel(model);
  EXPECT_EQ(Workspace(options_).views()[0].name, "..a/b..png");
}

// Not after the work, when a map's file gets its name.
TEST_F(WorkspaceTest, RefusesFileNamesThatLeaveNoRoomForThoseOfMaps) {
  SparseModel model = SmallModel();
  const std::string longest = "folder/" + std::string(235, 'n') + ".png";
  model.images[0].name = longest;
  WriteModel(model);
  const Workspace workspace(options_);
  for (const auto kind : {kPhotometric, kMeasured, kGeometric, kShared, kInferred}) {
    for (const auto& path : ResultPaths(workspace, 0, std::string(kind))) test_support::WriteBytes(path, "x");
  }
  model.images[0].name = "folder/" + std::string(236, 'n') + ".png";
  WriteModel(model);
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("too long: 240 bytes, at most 239"), HasSubstr("rename it")));
}

TEST_F(WorkspaceTest, RefusesTwoImagesOfOneNameAndModelsWithoutImages) {
  SparseModel model = SmallModel();
  model.images[2].name = "a.png";
  WriteModel(model);
  EXPECT_THAT(OpenError(), HasSubstr("two images are named 'a.png'; take one of them out"));
  model.images[2].name = ".//a.png";
  WriteModel(model);
  EXPECT_THAT(OpenError(), HasSubstr("the images 'a.png' and './/a.png' have the same file"));
  WriteModel(SparseModel());
  EXPECT_THAT(OpenError(), HasSubstr("no images"));
}

// The filled mask of one would be the measured mask of the other, and each stage would take or remove the wrong one's.
TEST_F(WorkspaceTest, RefusesImagesWhoseMasksHaveOneName) {
  SparseModel model = SmallModel();
  model.images[2].name = "./a.png.measured";
  WriteModel(model);
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("the images 'a.png' and './a.png.measured' would have the same mask"),
                                 HasSubstr("'a.png.measured.png'"), HasSubstr("rename one of them")));
  model.images[2].name = "a.measured.png";
  WriteModel(model);
  EXPECT_EQ(Workspace(options_).views().size(), 3u) << "its masks have other names";
}

TEST_F(WorkspaceTest, RefusesPmvsInOneSentence) {
  options_.format = "pmvs";
  const std::string message =
      test_support::MessageOf<phi::UsageError>([&] { Workspace workspace(options_); });
  EXPECT_THAT(message, AllOf(HasSubstr("PMVS is not supported"), HasSubstr("--output_type COLMAP")));
  options_.format = "ABC";
  EXPECT_THAT(test_support::MessageOf<phi::UsageError>([&] { Workspace workspace(options_); }),
              HasSubstr("ABC"));
  options_.format = "colmap";
  EXPECT_EQ(Workspace(options_).views().size(), 3u);
}

TEST_F(WorkspaceTest, NamesTheFolderThatIsNoWorkspace) {
  options_.path = folder_ / "none";
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("none"), HasSubstr("--workspace_path")));
  options_.path = folder_ / "images";
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("has no folder 'sparse'"), HasSubstr("image_undistorter wrote, with --output_type COLMAP")));
}

TEST_F(WorkspaceTest, IsFoundBelowTheFolderThatHoldsIt) {
  EXPECT_EQ(FindWorkspaceFolder(folder_.path()), folder_.path());
  const TemporaryFolder project;
  EXPECT_EQ(FindWorkspaceFolder(project.path()), project.path());
  std::filesystem::create_directories(project / "sparse/0");  // the mapper's
  std::filesystem::create_directories(project / "images");
  test_support::WriteSmallWorkspace(project / "dense/0");
  EXPECT_EQ(FindWorkspaceFolder(project.path()), project / "dense/0");
  EXPECT_EQ(FindWorkspaceFolder(project / "dense"), project / "dense/0");
  test_support::WriteSmallWorkspace(project / "dense/1");
  EXPECT_THAT(InputErrorOf([&] { FindWorkspaceFolder(project.path()); }),
              AllOf(HasSubstr("dense/0"), HasSubstr("dense/1")));
  test_support::WriteSmallWorkspace(project / "dense");
  EXPECT_EQ(FindWorkspaceFolder(project.path()), project / "dense");
}

// image_undistorter copies photos without distortion and leaves their camera what it is.
TEST_F(WorkspaceTest, CamerasWithoutDistortionArePinholes) {
  SparseModel model = SmallModel();
  const auto pinhole = [&](int model_id, const std::vector<double>& params) {
    model.cameras[4].model_id = model_id;
    model.cameras[4].params = params;
    WriteModel(model);
    const phi::Pinhole k = Workspace(options_).views()[2].camera.pinhole;
    return std::vector<double>{k.fx, k.fy, k.cx, k.cy};
  };
  EXPECT_THAT(pinhole(2, {25, 10, 5, 0}), ElementsAre(25, 25, 10, 5));
  EXPECT_THAT(pinhole(3, {25, 10, 5, 0, -1e-9}), ElementsAre(25, 25, 10, 5));
  EXPECT_THAT(pinhole(4, {25, 26, 10, 5, 0, 0, 0, 0}), ElementsAre(25, 26, 10, 5));
  EXPECT_THAT(pinhole(6, {25, 26, 10, 5, 0, 0, 0, 0, 0, 0, 0, 0}), ElementsAre(25, 26, 10, 5));
  EXPECT_THROW(pinhole(4, {25, 26, 10, 5, 0, 0, 0, 1e-3}), phi::InputError);
  EXPECT_THROW(pinhole(5, {25, 26, 10, 5, 0, 0, 0, 0}), phi::InputError) << "a fisheye";
}

TEST_F(WorkspaceTest, ListsAllProblemsOnRequest) {
  SparseModel model = SmallModel();
  model.cameras[4].model_id = 2;
  model.cameras[4].params = {25, 10, 5, 0.1};
  model.images[0].name = "../x.png";
  WriteModel(model);
  ProblemList problems;
  const Workspace workspace(options_, &problems);
  EXPECT_THAT(problems, ElementsAre(HasSubstr("SIMPLE_RADIAL"), HasSubstr("../x.png")));
  EXPECT_EQ(workspace.views()[2].camera.pinhole.width, 0);
}

// Each point lies in front of the cameras that saw it, and near where they saw it.
TEST(RealWorkspaceTest, PointsProjectToTheirObservations) {
  const auto scene = test_support::FindScene("fountain");
  if (scene.empty()) GTEST_SKIP() << "scene 'fountain' is not there; set PHIMVS_TEST_DATA";
  const Workspace workspace({scene / "dense", "COLMAP", 768});
  const SparseModel& model = workspace.model();
  ASSERT_EQ(workspace.views().size(), 11u);
  ASSERT_EQ(workspace.ReadGray(0)->height(), 512);
  std::vector<double> errors;  // full-size pixels, along x
  for (const SparsePoint& point : model.points) {
    for (const TrackElement& element : point.track) {
      const auto image = std::find_if(model.images.begin(), model.images.end(),
                                      [&](const SparseImage& i) { return i.image_id == element.image_id; });
      const phi::Camera& view = workspace.views()[image - model.images.begin()].camera;
      const Eigen::Vector3d in_camera = view.pose * point.xyz;
      ASSERT_GT(in_camera.z(), 0);
      const double u = view.pinhole.fx * in_camera.x() / in_camera.z() + view.pinhole.cx;
      const double full_width = static_cast<double>(model.cameras.at(image->camera_id).width);
      errors.push_back(
          std::abs(u * full_width / view.pinhole.width - image->observations[element.observation_index].x));
    }
  }
  ASSERT_GT(errors.size(), 1000u);
  std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
  EXPECT_LT(errors[errors.size() / 2], 1.0);
}

// A small file may announce a gigabyte: of this one nothing but the header can be decoded.
TEST_F(WorkspaceTest, AMasksSizeIsComparedBeforeItIsDecoded) {
  options_.mask_path = folder_ / "masks";
  std::filesystem::create_directory(options_.mask_path);
  const Workspace workspace(options_);
  const std::filesystem::path path = workspace.ImageMaskPath(0);
  WriteGrayImage(path, phi::GrayImage(37, 21, 255));
  test_support::WriteBytes(path, test_support::ReadBytes(path).substr(0, 40));
  EXPECT_THAT(InputErrorOf([&] { workspace.ReadImageMask(0); }), HasSubstr("the mask is 37x21 pixels"));
}

// Twice the quaternion turns as the quaternion does.
TEST_F(WorkspaceTest, RotationsHaveLengthOne) {
  SparseModel model = SmallModel();
  const Eigen::Matrix3d expected = Workspace(options_).views()[1].camera.pose.rotation;
  for (SparseImage& image : model.images) image.rotation.coeffs() *= 2;
  WriteModel(model);
  EXPECT_TRUE(Workspace(options_).views()[1].camera.pose.rotation.isApprox(expected));
}

}  // namespace
}  // namespace colmap_ext

#include "colmap_ext/workspace_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <opencv2/imgcodecs.hpp>

#include "colmap_ext/compact_codes.h"
#include "colmap_ext/compact_map.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/pipeline/file_identity.h"
#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "tests/support/error_message.h"
#include "tests/support/small_workspace.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_data.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::SmallModel;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class WorkspaceCheckTest : public ::testing::Test {
 protected:
  WorkspaceCheckTest() {
    options_.path = folder_.path();
    test_support::WriteSmallWorkspace(folder_.path());
    // c.png sees no point in the small model.
    SparseModel model = SmallModel();
    model.images[2].observations = {{1, 2, 12}};
    WriteSparseModelBinary(model, folder_ / "sparse");
  }
  fs::path Map(const char* folder, const std::string& name) { return folder_ / "stereo" / folder / name; }
  void WriteMaps(const std::string& name, int width, int height) {
    WritePlaneMap(Map("depth_maps", name), Map("normal_maps", name), phi::PlaneMap(width, height));
  }

  TemporaryFolder folder_;
  WorkspaceOptions options_;
};

TEST_F(WorkspaceCheckTest, FindsNothingWrongWithAGoodWorkspace) {
  WriteMaps("a.png.photometric.bin", 32, 24);
  WriteMaps("a.png.geometric.bin", 16, 12);
  WriteMask(folder_ / "stereo/filled_masks/a.png.png", phi::Mask(16, 12));
  const WorkspaceReport report = CheckWorkspace(options_);
  EXPECT_THAT(report.errors, IsEmpty());
  EXPECT_THAT(report.warnings, IsEmpty());
  EXPECT_EQ(report.num_images, 3u);
  EXPECT_EQ(report.num_points, 2u);
  EXPECT_EQ(report.num_reference_images, 3u);
}

TEST_F(WorkspaceCheckTest, ListsEveryProblemAtOnce) {
  SparseModel model = SmallModel();
  model.cameras[4].model_id = 2;
  model.cameras[4].params = {25, 10, 5, 0.1};
  WriteSparseModelBinary(model, folder_ / "sparse");
  WriteGrayImage(folder_ / "images/a.png", phi::GrayImage(10, 20));
  fs::remove(folder_ / "images/sub folder/b \xC3\xA9.png");
  WriteBytes(folder_ / "images/c.png", "no image");
  WriteBytes(folder_ / "stereo/patch-match.cfg", "a.png\nd.png\n");
  fs::remove(folder_ / "stereo/fusion.cfg");
  WriteBytes(folder_ / "stereo/.phimvs-1-2.tmp", "");
  const WorkspaceReport report = CheckWorkspace(options_);
  EXPECT_THAT(report.errors, UnorderedElementsAre(HasSubstr("SIMPLE_RADIAL"), HasSubstr("is 10x20 pixels"),
                                                  AllOf(HasSubstr("sub folder/b"), HasSubstr("missing")),
                                                  AllOf(HasSubstr("c.png"), HasSubstr("damaged")),
                                                  HasSubstr("'d.png'"), HasSubstr("fusion.cfg")));
  EXPECT_THAT(report.warnings,
              UnorderedElementsAre(HasSubstr("1 of 3 images see no sparse point, 'c.png' the first"), HasSubstr(".phimvs-1-2.tmp")));
}

TEST_F(WorkspaceCheckTest, ListsProblemsOfMaps) {
  WriteMaps("a.png.photometric.bin", 32, 24);
  fs::remove(Map("normal_maps", "a.png.photometric.bin"));
  WriteMaps("a.png.measured.bin", 30, 24);
  WriteMaps("a.png.geometric.bin", 32, 24);
  WriteBytes(Map("depth_maps", "a.png.geometric.bin"), "32&24&1&");
  WriteMaps("c.png.geometric.bin", 20, 10);
  WriteDepthMap(Map("normal_maps", "c.png.geometric.bin"), phi::Array2D<float>(20, 10));
  WriteMask(folder_ / "stereo/filled_masks/c.png.png", phi::Mask(16, 12));
  const WorkspaceReport report = CheckWorkspace(options_);
  EXPECT_THAT(
      report.errors,
      ElementsAre(AllOf(HasSubstr("depth_maps/a.png.photometric.bin"), HasSubstr("to go with it")),
                  AllOf(HasSubstr("depth_maps/a.png.measured.bin"), HasSubstr("30x24 pixels does not fit")),
                  AllOf(HasSubstr("normal_maps/a.png.measured.bin"), HasSubstr("does not fit")),
                  AllOf(HasSubstr("depth_maps/a.png.geometric.bin"), HasSubstr("has 8 bytes")),
                  AllOf(HasSubstr("normal_maps/c.png.geometric.bin"), HasSubstr("1 channels instead of 3")),
                  AllOf(HasSubstr("c.png.png"), HasSubstr("the mask is 16x12"))));
}

TEST_F(WorkspaceCheckTest, PhotosOfOtherNamesAreOneErrorThatSaysWhatIsThere) {
  const fs::path images = folder_ / "images";
  fs::rename(images / "sub folder/b \xC3\xA9.png", images / "B \xC3\xA9.PNG");
  EXPECT_THAT(CheckWorkspace(options_).errors, ElementsAre(HasSubstr("sub folder/b")));  // the others are there
  fs::create_directories(images / "photos");
  fs::rename(images / "a.png", images / "photos/A.JPG");
  fs::rename(images / "c.png", images / "photos/other.png");
  WriteBytes(images / ".hidden", "");
  EXPECT_THAT(CheckWorkspace(options_).errors,
              ElementsAre(images.string() +
                          ": none of the 3 images of the sparse model is there, but 3 other files are, such as "
                          "'photos/A.JPG', where the model has 'a.png'; give them the model's names, or run colmap "
                          "image_undistorter again"));
  fs::rename(images / "photos/A.JPG", images / "photos/first.jpg");
  EXPECT_THAT(CheckWorkspace(options_).errors, ElementsAre(HasSubstr("3 other files are, 'B \xC3\xA9.PNG' the first, where")));
  fs::remove_all(images);
  EXPECT_THAT(CheckWorkspace(options_).errors, ElementsAre(HasSubstr("is there, nor the folder; put back what")));
  fs::create_directories(images);
  EXPECT_THAT(CheckWorkspace(options_).errors, ElementsAre(HasSubstr("is there, nor any other file; put back what")));
}

TEST_F(WorkspaceCheckTest, FoldersOfWindowsAreKnown) {
  SparseModel model = SmallModel();
  model.images[0].name = "left\\a.png";
  model.images[1].name = "left\\b.png";
  model.images[2].name = "left\\c.png";
  WriteSparseModelBinary(model, folder_ / "sparse");
  EXPECT_THAT(CheckWorkspace(options_).errors,
              ::testing::Contains(HasSubstr("such as 'a.png', where the model has 'left\\a.png'")));
}

// As image_undistorter --copy_policy soft-link leaves them.
TEST_F(WorkspaceCheckTest, LinksToPhotosThatMovedAreNamed) {
  const fs::path images = folder_ / "images";
  fs::remove_all(images);
  fs::create_directories(images / "sub folder");
  for (const char* name : {"a.png", "sub folder/b \xC3\xA9.png", "c.png"}) fs::create_symlink("/gone/" + std::string(name), images / name);
  EXPECT_THAT(CheckWorkspace(options_).errors,
              ElementsAre(HasSubstr("is there: 'a.png' is a link to /gone/a.png, which cannot be reached; mount or restore that")));
  fs::remove_all(images);
  fs::create_symlink("/gone", images);
  EXPECT_THAT(CheckWorkspace(options_).errors, ElementsAre(HasSubstr("'images' is a link to /gone, which cannot be reached")));
}

// A camera numbers its photos; copies of them get other words and other zeros.
TEST_F(WorkspaceCheckTest, PhotosOfOtherNamesAreKnownByTheirNumber) {
  SparseModel model = SmallModel();
  for (const auto& [image, name] : {std::pair{0, "IMG_0012.JPG"}, {1, "IMG_0013.JPG"}, {2, "IMG_0014.JPG"}}) model.images[image].name = name;
  WriteSparseModelBinary(model, folder_ / "sparse");
  fs::remove_all(folder_ / "images");
  fs::create_directories(folder_ / "images");
  for (const char* name : {"frame2.png", "frame12.png", "none.png"}) WriteBytes(folder_ / "images" / name, "");
  EXPECT_THAT(CheckWorkspace(options_).errors,
              ::testing::Contains(HasSubstr("such as 'frame12.png', where the model has 'IMG_0012.JPG'")));
}

TEST_F(WorkspaceCheckTest, ListsProblemsOfMasks) {
  options_.mask_path = folder_ / "masks";
  fs::create_directories(options_.mask_path / "sub folder");
  const auto write = [&](const std::string& name, int width, int height) {
    WriteGrayImage(options_.mask_path / name, phi::GrayImage(width, height, 255));
  };
  write("a.png.png", 32, 24);
  write("sub folder/b \xC3\xA9.png.png", 32, 24);
  write("c.png.png", 20, 10);
  EXPECT_THAT(CheckWorkspace(options_).errors, IsEmpty());
  EXPECT_THAT(CheckWorkspace(options_).warnings, IsEmpty());
  write("a.png.png", 30, 24);
  WriteBytes(options_.mask_path / "c.png.png", "no image");
  fs::remove(options_.mask_path / "sub folder/b \xC3\xA9.png.png");
  write("sub folder/b.png", 32, 24);
  write("z.png", 32, 24);
  const WorkspaceReport report = CheckWorkspace(options_);
  EXPECT_THAT(report.errors, ElementsAre(AllOf(HasSubstr("masks/a.png.png"), HasSubstr("is 30x24 pixels but its image is 32x24")),
                                         AllOf(HasSubstr("masks/c.png.png"), HasSubstr("damaged"))));
  EXPECT_THAT(report.warnings,
              ElementsAre(AllOf(HasSubstr("1 of 3 images have no mask"), HasSubstr("b \xC3\xA9.png.png")),
                          options_.mask_path.string() + ": 2 files are masks of no image, 'sub folder/b.png' the first; "
                                                        "that of image 'sub folder/b \xC3\xA9.png' would be 'sub folder/b \xC3\xA9.png.png'"));
  fs::remove(options_.mask_path / "z.png");
  EXPECT_THAT(CheckWorkspace(options_).warnings, ::testing::Contains(HasSubstr("'sub folder/b.png' is the mask of no image; that")));
}

// Of photos that were cut out: the mask is in their transparency, where nothing reads it.
TEST_F(WorkspaceCheckTest, NamesMasksThatDoNotMaskWhatTheyShow) {
  options_.mask_path = folder_ / "masks";
  fs::create_directories(options_.mask_path / "sub folder");
  WriteGrayImage(options_.mask_path / "a.png.png", phi::GrayImage(32, 24, 0));
  cv::imwrite((options_.mask_path / "c.png.png").string(), cv::Mat(10, 20, CV_8UC4, cv::Scalar(90, 90, 90, 0)));
  WriteGrayImage(options_.mask_path / "sub folder/b \xC3\xA9.png.png", phi::GrayImage(32, 24, 255));
  const auto warnings = ElementsAre(AllOf(HasSubstr("masks/a.png.png"), HasSubstr("leaves the whole image out")),
                                    AllOf(HasSubstr("1 masks have a channel of transparency"), HasSubstr("masks/c.png.png the first")));
  EXPECT_THAT(CheckWorkspace(options_).warnings, warnings);
  options_.mask_path.clear();
  EXPECT_THAT(CheckWorkspace(options_, {}, folder_ / "masks").warnings, warnings);
}

TEST_F(WorkspaceCheckTest, PhotosBesideTheirMasksAreNoMasks) {
  options_.mask_path = folder_ / "images/../images";
  for (const char* name : {"a.png.png", "sub folder/b \xC3\xA9.png.png"}) WriteGrayImage(folder_ / "images" / name, phi::GrayImage(32, 24, 255));
  EXPECT_THAT(CheckWorkspace(options_).warnings, ElementsAre(HasSubstr("1 of 3 images have no mask")));
}

// Of any size there: fusion stretches them.
TEST_F(WorkspaceCheckTest, ListsProblemsOfFusionsMasks) {
  const fs::path masks = folder_ / "fusion masks";
  const auto check = [&] { return CheckWorkspace(options_, {}, masks); };
  EXPECT_THAT(check().errors, ElementsAre("--StereoFusion.mask_path: there is no folder " + masks.string()));
  const auto write = [&](const std::string& name, int width, int height) {
    fs::create_directories((masks / name).parent_path());
    WriteGrayImage(masks / name, phi::GrayImage(width, height, 255));
  };
  write("a.png.png", 64, 48);
  write("sub folder/b \xC3\xA9.png.png", 16, 12);
  write("c.png.png", 20, 10);
  EXPECT_THAT(check().errors, IsEmpty());
  EXPECT_THAT(check().warnings, IsEmpty());
  write("a.png.png", 48, 64);
  WriteBytes(masks / "c.png.png", "no image");
  fs::remove(masks / "sub folder/b \xC3\xA9.png.png");
  write("sub folder/b.png", 32, 24);
  const WorkspaceReport report = check();
  EXPECT_THAT(report.errors, ElementsAre(AllOf(HasSubstr((masks / "c.png.png").string()), HasSubstr("damaged"))));
  EXPECT_THAT(report.warnings,
              ElementsAre(AllOf(HasSubstr((masks / "a.png.png").string()),
                                HasSubstr("is 48x64 pixels, which is not the shape of its 32x24 image")),
                          AllOf(HasSubstr("1 of 3 images have no mask"), HasSubstr((masks / "sub folder").string())),
                          HasSubstr("'sub folder/b.png' is the mask of no image")));
}

// The record of a finished run that made these files.
void WriteRecord(const fs::path& stereo, const RunRecord::Task& task, const std::vector<fs::path>& files) {
  TaskRecord result;
  result.state = "done";
  for (const fs::path& file : files) result.files.push_back(IdentifyFile(file));
  RunRecord record(stereo);
  record.Finish(task, result);
  record.Compact();
}

fs::path WriteCompactMap(const fs::path& stereo, const std::string& name, int width, int height) {
  const phi::MeasurementMap map{phi::PlaneMap(width, height, {{0, 0, -1}, 2}), {}};
  PrepareCompactMap(stereo / "compact_maps" / name, RoundToCompact(map))->Commit();
  return stereo / "compact_maps" / name;
}

TEST_F(WorkspaceCheckTest, ListsProblemsOfCompactMaps) {
  const fs::path stereo = folder_ / "stereo";
  const fs::path good = WriteCompactMap(stereo, "a.png.photometric.map", 32, 24);
  const fs::path other_size = WriteCompactMap(stereo, "a.png.measured.map", 30, 24);
  const fs::path damaged = WriteCompactMap(stereo, "c.png.photometric.map", 20, 10);
  WriteRecord(stereo, {"a.png", "photometric"}, {good});
  WriteRecord(stereo, {"a.png", "measured"}, {other_size});
  EXPECT_THAT(
      CheckWorkspace(options_).errors,
      ElementsAre(AllOf(HasSubstr(other_size.string()), HasSubstr("30x24 pixels does not fit")),
                  AllOf(HasSubstr(damaged.string()), HasSubstr("not made by phimvs in this workspace"))));
  fs::resize_file(damaged, fs::file_size(damaged) - 1);
  fs::remove(other_size);
  EXPECT_THAT(CheckWorkspace(options_).errors,
              ElementsAre(AllOf(HasSubstr(damaged.string()), HasSubstr("damaged"))));
  fs::remove(damaged);
  EXPECT_THAT(CheckWorkspace(options_).errors, IsEmpty());
}

// phimvs reads the compact map; its user, who sees the other one, would not know.
TEST_F(WorkspaceCheckTest, NamesMapsThatACompactOneHides) {
  const fs::path stereo = folder_ / "stereo",
                 compact = WriteCompactMap(stereo, "a.png.photometric.map", 32, 24);
  WriteMaps("a.png.photometric.bin", 32, 24);
  const fs::path depth = Map("depth_maps", "a.png.photometric.bin"),
                 normal = Map("normal_maps", "a.png.photometric.bin");
  WriteDepthMap(depth, phi::Array2D<float>(32, 24, 5));
  WriteRecord(stereo, {"a.png", "photometric"}, {compact, normal});
  EXPECT_THAT(
      CheckWorkspace(options_).errors,
      ElementsAre(AllOf(HasSubstr(depth.string()), HasSubstr(compact.string()), HasSubstr("in its place"))));
  WriteRecord(stereo, {"a.png", "photometric"}, {compact, depth, normal});  // of a conversion that was killed
  EXPECT_THAT(CheckWorkspace(options_).errors, IsEmpty());
}

TEST_F(WorkspaceCheckTest, MapsOnAnotherDiskAreLookedAt) {
  const TemporaryFolder other_disk;
  fs::create_directories(other_disk / "depth");
  fs::create_directory_symlink(other_disk / "depth", folder_ / "stereo/depth_maps");
  WriteBytes(other_disk / "depth/.phimvs-1-2.tmp", "");
  EXPECT_THAT(CheckWorkspace(options_).warnings, ElementsAre(HasSubstr("stereo/depth_maps/.phimvs-1-2.tmp")));
  RemoveTemporaryFiles(folder_ / "stereo");
  EXPECT_THAT(CheckWorkspace(options_).warnings, IsEmpty());
}

// Of an industrial camera: values of 12 bits in files of 16 left 16 levels of grey, in silence.
TEST_F(WorkspaceCheckTest, PhotosOfFewerThan16BitsInFilesOf16AreTold) {
  const auto warnings = [&](int brightest) {
    cv::Mat photo(24, 32, CV_16UC1, cv::Scalar(100));
    photo.at<std::uint16_t>(5, 7) = static_cast<std::uint16_t>(brightest);
    cv::imwrite((folder_ / "images/a.png").string(), photo);
    return CheckWorkspace(options_).warnings;
  };
  EXPECT_THAT(warnings(16383),
              ElementsAre("1 of 3 photos looked at, a.png the first, have 16 bits but no value above 16383 of 65535: scale "
                          "values of 10, 12 or 14 bits to the full range, else few levels of gray are left to match"));
  EXPECT_THAT(warnings(16384), IsEmpty());
  // Before decoding: a file may announce far more pixels than it has bytes.
  cv::imwrite((folder_ / "images/a.png").string(), cv::Mat(24, 33, CV_16UC1, cv::Scalar(100)));
  EXPECT_THAT(CheckWorkspace(options_).warnings, IsEmpty());
}

// Here for access(), which asks for the real user.
class OtherUser {
 public:
  OtherUser() { EXPECT_TRUE(::geteuid() != 0 || ::setreuid(65534, 0) == 0); }
  ~OtherUser() { EXPECT_TRUE(::geteuid() != 0 || ::setreuid(0, 0) == 0); }
};

TEST_F(WorkspaceCheckTest, AFolderOfImagesThatCannotBeReadIsTold) {
  const fs::path images = folder_ / "images";
  fs::remove_all(images);  // root would see them
  fs::create_directories(images);
  fs::permissions(images, fs::perms::none);
  ProblemList errors;
  {
    const OtherUser user;
    errors = CheckWorkspace(options_).errors;
  }
  fs::permissions(images, fs::perms::owner_all);
  EXPECT_THAT(errors, ::testing::Contains(images.string() + ": this folder of the images cannot be read; change its permissions"));
}

TEST_F(WorkspaceCheckTest, AFolderThatCannotBeWrittenIsAnErrorWhileMapsAreToBeMade) {
  const fs::path stereo = folder_ / "stereo";
  const auto errors = [&] {
    fs::permissions(stereo, fs::perms::owner_read | fs::perms::owner_exec);
    ProblemList found;
    {
      const OtherUser user;
      found = CheckWorkspace(options_).errors;
    }
    fs::permissions(stereo, fs::perms::owner_all);
    return found;
  };
  const auto cannot_be_written = ElementsAre(HasSubstr("maps cannot be written into this folder"));
  EXPECT_THAT(errors(), cannot_be_written);
  // Of a run without geometric consistency, which makes one kind.
  const std::vector<std::string> names = {"a.png", "sub folder/b \xC3\xA9.png", "c.png"};
  fs::create_directories(stereo / "depth_maps/sub folder");
  fs::create_directories(stereo / "normal_maps/sub folder");
  for (const std::string& name : names) {
    EXPECT_THAT(errors(), cannot_be_written) << name;
    const std::string map = name + ".photometric.bin";
    WriteMaps(map, name == "c.png" ? 20 : 32, name == "c.png" ? 10 : 24);
    WriteRecord(stereo, {name, "photometric"}, {Map("depth_maps", map), Map("normal_maps", map)});
  }
  EXPECT_THAT(errors(), IsEmpty());
  RunRecord(stereo).Begin({{"a.png", "photometric"}}, {"other options"});
  EXPECT_THAT(errors(), cannot_be_written) << "a run was killed";
}

TEST_F(WorkspaceCheckTest, ADamagedRecordIsOneError) {
  WriteCompactMap(folder_ / "stereo", "a.png.photometric.map", 32, 24);
  WriteBytes(folder_ / "stereo/phimvs.json", "{");
  EXPECT_THAT(CheckWorkspace(options_).errors, ElementsAre(HasSubstr("phimvs.json is damaged")));
}

TEST_F(WorkspaceCheckTest, ReportsAModelThatCannotBeRead) {
  WriteBytes(folder_ / "sparse/images.bin", "short");
  EXPECT_THAT(CheckWorkspace(options_).errors, ElementsAre(HasSubstr("images.bin: byte 5")));
  options_.path = folder_ / "none";
  EXPECT_THAT(CheckWorkspace(options_).errors, ElementsAre(HasSubstr("--workspace_path")));
  options_.format = "PMVS";
  EXPECT_THAT(test_support::MessageOf<phi::UsageError>([&] { CheckWorkspace(options_); }), HasSubstr("PMVS"));
}

TEST_F(WorkspaceCheckTest, WarnsOfModelsWithoutPoints) {
  SparseModel model = SmallModel();
  model.points.clear();
  WriteSparseModelBinary(model, folder_ / "sparse");
  EXPECT_THAT(CheckWorkspace(options_).warnings, ElementsAre(HasSubstr("the model has no points")));
}

TEST(RealWorkspaceCheckTest, ScenesAreInOrder) {
  const auto scene = test_support::FindScene("herzjesu");
  if (scene.empty()) GTEST_SKIP() << "scene 'herzjesu' is not there; set PHIMVS_TEST_DATA";
  const WorkspaceReport report = CheckWorkspace({scene / "dense"});
  EXPECT_THAT(report.errors, IsEmpty());
  EXPECT_EQ(report.num_images, 8u);
}

}  // namespace
}  // namespace colmap_ext

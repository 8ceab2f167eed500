#include "colmap_ext/sparse_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <random>

#include "phi/base/error.h"
#include "tests/colmap_ext/sparse_model_golden.h"
#include "tests/support/error_message.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/log_capture.h"
#include "tests/support/small_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::ExpectSameModel;
using test_support::FileSizeLimit;
using test_support::GoldenBytes;
using test_support::InputErrorOf;
using test_support::ReadBytes;
using test_support::SmallModel;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class SparseModelTest : public ::testing::Test {
 protected:
  void WriteGoldenBinary() {
    WriteBytes(folder_ / "cameras.bin", GoldenCamerasBin());
    WriteBytes(folder_ / "images.bin", GoldenImagesBin());
    WriteBytes(folder_ / "points3D.bin", GoldenPointsBin());
  }
  void WriteGoldenText() {
    WriteBytes(folder_ / "cameras.txt", GoldenCamerasTxt());
    WriteBytes(folder_ / "images.txt", GoldenImagesTxt());
    WriteBytes(folder_ / "points3D.txt", GoldenPointsTxt());
  }
  std::string ReadError() {
    return InputErrorOf([&] { ReadSparseModel(folder_.path()); });
  }

  TemporaryFolder folder_;
};

TEST_F(SparseModelTest, BinaryFilesHaveTheExactBytes) {
  WriteSparseModelBinary(SmallModel(), folder_.path());
  EXPECT_EQ(ReadBytes(folder_ / "cameras.bin"), GoldenCamerasBin());
  EXPECT_EQ(ReadBytes(folder_ / "images.bin"), GoldenImagesBin());
  EXPECT_EQ(ReadBytes(folder_ / "points3D.bin"), GoldenPointsBin());
}

TEST_F(SparseModelTest, TextFilesHaveTheExactBytes) {
  WriteSparseModelText(SmallModel(), folder_.path());
  EXPECT_EQ(ReadBytes(folder_ / "cameras.txt"), GoldenCamerasTxt());
  EXPECT_EQ(ReadBytes(folder_ / "images.txt"), GoldenImagesTxt());
  EXPECT_EQ(ReadBytes(folder_ / "points3D.txt"), GoldenPointsTxt());
}

// The cameras have room, the points have not.
TEST_F(SparseModelTest, AFullDiskLeavesTheEarlierModelWhole) {
  SparseModel larger = SmallModel();
  larger.cameras.begin()->second.params[0] += 1;
  larger.points.resize(1000, larger.points[0]);
  for (const bool is_text : {false, true}) {
    const auto write = is_text ? WriteSparseModelText : WriteSparseModelBinary;
    const std::string suffix = is_text ? ".txt" : ".bin";
    write(SmallModel(), folder_.path());
    for (const char* name : {"rigs", "frames"}) WriteBytes(folder_ / (name + suffix), "of COLMAP 4");
    {
      const FileSizeLimit limit(4096);
      EXPECT_THROW(write(larger, folder_.path()), phi::Error);
    }
    EXPECT_EQ(ReadBytes(folder_ / ("cameras" + suffix)), is_text ? GoldenCamerasTxt() : GoldenCamerasBin());
    EXPECT_EQ(ReadBytes(folder_ / ("points3D" + suffix)), is_text ? GoldenPointsTxt() : GoldenPointsBin());
    for (const char* name : {"rigs", "frames"}) EXPECT_TRUE(std::filesystem::exists(folder_ / (name + suffix)));
    write(larger, folder_.path());
    for (const char* name : {"rigs", "frames"}) EXPECT_FALSE(std::filesystem::exists(folder_ / (name + suffix)));
  }
}

TEST_F(SparseModelTest, ReadsBinaryInTheFilesOrder) {
  WriteGoldenBinary();
  const SparseModel model = ReadSparseModel(folder_.path());
  ExpectSameModel(model, SmallModel(), 0);
  EXPECT_EQ(model.images[0].image_id, 7u);
  EXPECT_EQ(model.images[1].image_id, 3u);
  EXPECT_EQ(model.images[2].image_id, 9u);
}

TEST_F(SparseModelTest, ReadsText) {
  WriteGoldenText();
  ExpectSameModel(ReadSparseModel(folder_.path()), SmallModel(), 0);
}

TEST_F(SparseModelTest, PrefersBinaryAndToleratesRigsAndFrames) {
  WriteGoldenBinary();
  for (const char* name :
       {"cameras.txt", "images.txt", "points3D.txt", "rigs.bin", "frames.bin", "rigs.txt"}) {
    WriteBytes(folder_ / name, "nonsense");
  }
  ExpectSameModel(ReadSparseModel(folder_.path()), SmallModel(), 0);
}

TEST_F(SparseModelTest, TextSurvivesWindowsLineEndsCommentsAndBlankLines) {
  WriteGoldenText();
  std::string cameras = GoldenCamerasTxt();
  for (std::size_t at = 0; (at = cameras.find('\n', at)) != std::string::npos; at += 2)
    cameras.insert(at, 1, '\r');
  WriteBytes(folder_ / "cameras.txt", "\n# a comment\n" + cameras);
  ExpectSameModel(ReadSparseModel(folder_.path()), SmallModel(), 0);
}

TEST_F(SparseModelTest, TextMayBeginWithAByteOrderMark) {
  WriteSparseModelText(SmallModel(), folder_.path());
  for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
    WriteBytes(folder_ / name, "\xEF\xBB\xBF" + ReadBytes(folder_ / name));
  }
  ExpectSameModel(ReadSparseModel(folder_.path()), SmallModel(), 1e-15);
}

TEST_F(SparseModelTest, NumbersSurviveTextExactly) {
  SparseModel model = SmallModel();
  model.images[0].translation = {1.0 / 3, 1e-300, 4321987.123456789};
  model.points[0].xyz = {0.1, -2.0 / 7, 6.02214076e23};
  WriteSparseModelText(model, folder_.path());
  ExpectSameModel(ReadSparseModel(folder_.path()), model, 0);
}

TEST_F(SparseModelTest, NamesTheMissingModelAndTheNextStep) {
  EXPECT_THAT(ReadError(), AllOf(HasSubstr(folder_.path().string()), HasSubstr("colmap image_undistorter")));
  WriteSparseModelBinary(SmallModel(), folder_ / "0");
  EXPECT_THAT(ReadError(), HasSubstr((folder_ / "0").string()));
}

// Of a rig or a SLAM, whose poses are given.
TEST_F(SparseModelTest, APointFileThatIsMissingIsNamed) {
  WriteSparseModelText(SmallModel(), folder_.path());
  std::filesystem::remove(folder_ / "points3D.txt");
  EXPECT_EQ(InputErrorOf([&] { ReadSparseModel(folder_.path()); }),
            (folder_ / "points3D.txt").string() +
                ": this file of the sparse model is missing; copy it, too. Where there are no points, an empty file will do");
  WriteBytes(folder_ / "points3D.txt", "");
  EXPECT_EQ(ReadSparseModel(folder_.path()).images.size(), 3u);
  EXPECT_TRUE(ReadSparseModel(folder_.path()).points.empty());
}

TEST_F(SparseModelTest, EveryTruncationOfABinaryFileIsAnInputErrorThatNamesIt) {
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    WriteGoldenBinary();
    const std::string whole = ReadBytes(folder_ / name);
    for (std::size_t length = 0; length < whole.size(); ++length) {
      WriteBytes(folder_ / name, whole.substr(0, length));
      ASSERT_THAT(ReadError(), AllOf(HasSubstr(name), HasSubstr(": byte "))) << name << " cut to " << length;
    }
  }
}

// A cut within the last record's last number can leave a valid file; every other cut must be noticed.
TEST_F(SparseModelTest, EveryTruncationOfATextFileBeforeTheLastRecordIsAnInputError) {
  const test_support::LogCapture quiet;
  const std::pair<const char*, const char*> last_records[] = {
      {"cameras.txt", "4 SIMPLE"}, {"images.txt", "9 0 1"}, {"points3D.txt", "12 0.125"}};
  for (const auto& [name, last_record] : last_records) {
    WriteGoldenText();
    const std::string whole = ReadBytes(folder_ / name);
    const std::size_t last = whole.find(std::string("\n") + last_record) + 1;
    const std::size_t announced = whole.find("Number of") + std::string("Number of cameras: 2").size();
    for (std::size_t length = 0; length < whole.size(); ++length) {
      WriteBytes(folder_ / name, whole.substr(0, length));
      try {
        ReadSparseModel(folder_.path());
        EXPECT_TRUE(length > last || (length < announced && std::string(name) == "points3D.txt"))
            << name << " cut to " << length << " was read";
      } catch (const phi::InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr(": line "));
      }
    }
  }
}

TEST_F(SparseModelTest, TextWithoutALastLineEndIsReadWithAWarning) {
  WriteGoldenText();
  const std::string points = GoldenPointsTxt();
  WriteBytes(folder_ / "points3D.txt", points.substr(0, points.size() - 1));
  const test_support::LogCapture log;
  ExpectSameModel(ReadSparseModel(folder_.path()), SmallModel(), 0);
  EXPECT_THAT(log.messages(), ElementsAre(HasSubstr("points3D.txt: line 4: the last line has no end")));
}

TEST_F(SparseModelTest, DamagedBytesNeverCrash) {
  const test_support::LogCapture quiet;
  std::mt19937 random(1);
  for (const char* name :
       {"cameras.bin", "images.bin", "points3D.bin", "cameras.txt", "images.txt", "points3D.txt"}) {
    std::filesystem::remove(folder_ / "cameras.bin");
    WriteGoldenText();
    if (std::string(name).ends_with(".bin")) WriteGoldenBinary();
    const std::string whole = ReadBytes(folder_ / name);
    for (int trial = 0; trial < 60; ++trial) {
      std::string damaged = whole;
      for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] = static_cast<char>(random());
      WriteBytes(folder_ / name, damaged);
      try {
        ProblemList problems;
        ReadSparseModel(folder_.path(), trial % 2 ? &problems : nullptr);
      } catch (const phi::InputError&) {
      }
    }
  }
}

TEST_F(SparseModelTest, AbsurdCountsAreRefusedBeforeMemoryIsAskedFor) {
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    WriteGoldenBinary();
    std::string bytes = ReadBytes(folder_ / name);
    bytes.replace(0, 8, GoldenBytes().U64(0x7FFFFFFFFFFFFFFF).bytes());
    WriteBytes(folder_ / name, bytes);
    EXPECT_THAT(ReadError(), AllOf(HasSubstr(name), HasSubstr("byte 0: 9223372036854775807")));
  }
}

TEST_F(SparseModelTest, SaysWhatIsWrongAndWhere) {
  struct Case {
    const char* file;
    const char* from;
    const char* to;
    const char* position;
    const char* message;
  };
  const Case cases[] = {
      {"images.txt", "2 1 a.png", "2 5 a.png", "line 3",
       "image 7 'a.png' uses camera 5, which is not among the cameras"},
      {"images.txt", "7 1 0 0 0", "7 0 0 0 0", "line 3", "rotation"},
      {"images.txt", "7 1 0 0 0", "7 1 0 zero 0", "line 3", "'zero'"},
      {"images.txt", "0.5 -0.25 2 1 a", "nan -0.25 2 1 a", "line 3", "translation"},
      {"images.txt", "0.5 -0.25 2 1 a", "1e30 -0.25 2 1 a", "line 3", "impossible translation"},
      {"images.txt", "9 0 1 0 0", "7 0 1 0 0", "line 7", "id that another image has"},
      {"images.txt", "5.5 6.5 12\n", "5.5 6.5\n", "line 4", "line ends before an observation's point id"},
      {"images.txt", "a.png", "", "line 3", "has no name"},
      {"cameras.txt", "32 24", "0 24", "line 3", "size of 0x24"},
      {"cameras.txt", "30 31 16 12", "30 31 16", "line 3", "has 3 parameters, but PINHOLE needs 4"},
      {"cameras.txt", "30 31", "inf 31", "line 3", "not a finite number"},
      {"cameras.txt", "SIMPLE_PINHOLE", "MIRROR_BALL", "line 4", "unknown camera model MIRROR_BALL"},
      {"cameras.txt", "4 SIMPLE_PINHOLE 20 10 25 10 5", "1 SIMPLE_PINHOLE 20 10 25 10 5", "line 4",
       "appears twice"},
      {"points3D.txt", "7 2\n", "8 2\n", "line 4",
       "point 12 was seen in image 8, which is not among the images"},
      {"points3D.txt", "7 2\n", "7 3\n", "line 4", "point 12 is observation 3 of image 7, which has only 3"},
      {"points3D.txt", "10 20 255", "10 20 256", "line 3", "colour"},
  };
  for (const Case& c : cases) {
    WriteGoldenText();
    std::string text = ReadBytes(folder_ / c.file);
    const std::size_t at = text.find(c.from);
    ASSERT_NE(at, std::string::npos) << c.from;
    WriteBytes(folder_ / c.file, text.replace(at, std::string(c.from).size(), c.to));
    EXPECT_THAT(ReadError(), AllOf(HasSubstr((folder_ / c.file).string() + ": " + c.position + ":"),
                                   HasSubstr(c.message)));
  }
}

TEST_F(SparseModelTest, PointsWithoutAPositionAreLeftOutWithOneWarning) {
  SparseModel model = SmallModel();
  model.points[0].xyz.x() = std::numeric_limits<double>::quiet_NaN();
  for (const bool binary : {true, false}) {
    const TemporaryFolder folder;
    (binary ? WriteSparseModelBinary : WriteSparseModelText)(model, folder.path());
    const test_support::LogCapture log;
    ProblemList problems;
    const SparseModel read = ReadSparseModel(folder.path(), &problems);
    EXPECT_THAT(problems, ElementsAre());
    ASSERT_EQ(read.points.size(), 1u);
    EXPECT_EQ(read.points[0].point3D_id, model.points[1].point3D_id);
    EXPECT_THAT(log.messages(),
                ElementsAre(AllOf(HasSubstr("points3D"), HasSubstr("the first of 1 points whose position"))));
  }
}

TEST_F(SparseModelTest, BinaryErrorsNameTheByteOfTheRecord) {
  WriteGoldenBinary();
  std::string bytes = GoldenCamerasBin();
  bytes.replace(12, 4, GoldenBytes().U32(99).bytes());
  WriteBytes(folder_ / "cameras.bin", bytes);
  EXPECT_THAT(ReadError(), AllOf(HasSubstr("cameras.bin: byte 8: camera 1 has unknown camera model 99"),
                                 HasSubstr("image_undistorter")));
  WriteBytes(folder_ / "cameras.bin", GoldenCamerasBin() + "x");
  EXPECT_THAT(ReadError(), HasSubstr("more bytes follow"));
}

TEST_F(SparseModelTest, ListsEveryProblemThatCanBeSteppedOver) {
  SparseModel model = SmallModel();
  model.cameras[4].width = 0;
  model.images[0].translation.x() = std::numeric_limits<double>::quiet_NaN();
  model.points[1].track[0].observation_index = 50;
  model.points[0].track[1].observation_index = 2;
  WriteSparseModelBinary(model, folder_.path());
  ProblemList problems;
  const SparseModel read = ReadSparseModel(folder_.path(), &problems);
  EXPECT_THAT(problems, ElementsAre(HasSubstr("camera 4"), HasSubstr("image 7"), HasSubstr("image 9"),
                                    HasSubstr("point 11")));
  ASSERT_EQ(read.images.size(), 1u);
  EXPECT_EQ(read.images[0].image_id, 3u);
  // The track of a point that was seen in a dropped image only is empty, not dangling.
  ASSERT_EQ(read.points.size(), 1u);
  EXPECT_TRUE(read.points[0].track.empty());
}

// A model whose images were thinned names them in thousands of tracks.
TEST_F(SparseModelTest, PointsThatNameTheSameImageWronglyAreOneProblem) {
  SparseModel model = SmallModel();
  const SparsePoint point = model.points[0];
  model.points.clear();
  for (std::uint64_t id = 1; id <= 500; ++id) {
    model.points.push_back(point);
    model.points.back().point3D_id = id;
    model.points.back().track = {{id % 2 == 0 ? 70u : 7u, id % 2 == 0 ? 0u : 50u}};
  }
  model.points.push_back(point);
  WriteSparseModelText(model, folder_.path());
  ProblemList problems;
  EXPECT_EQ(ReadSparseModel(folder_.path(), &problems).points.size(), 1u);
  EXPECT_THAT(problems,
              ElementsAre(HasSubstr("points3D.txt: line 3: 250 points are observations of image 7, which has only 3, point 1 the first"),
                          HasSubstr("points3D.txt: line 4: 250 points name image 70, which is not among the images, point 2 the first")));
  EXPECT_THAT(ReadError(), HasSubstr("points3D.txt: line 3: point 1 is observation 50 of image 7, which has only 3"));
}

TEST_F(SparseModelTest, KnowsColmapsCameraModelsByName) {
  EXPECT_EQ(CameraModelName(0), "SIMPLE_PINHOLE");
  EXPECT_EQ(CameraModelName(1), "PINHOLE");
  EXPECT_EQ(CameraModelName(4), "OPENCV");
  EXPECT_EQ(CameraModelName(11), "RAD_TAN_THIN_PRISM_FISHEYE");
  EXPECT_EQ(CameraModelName(99), "unknown camera model 99");
}

}  // namespace
}  // namespace colmap_ext

// The files are written here by hand; tests/colmap_ext/colmap_interop_test.cc reads those of pycolmap.
#include "colmap_ext/rig_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using ::testing::HasSubstr;

template <typename T>
std::string Bytes(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}

std::string Pose(bool is_text, const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
  std::string text;
  for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) {
    char number[40];
    std::snprintf(number, sizeof(number), "%.17g ", value);
    text += is_text ? number : Bytes(value);
  }
  return text;
}

// A rig whose reference is an IMU, and two cameras, of which the second is turned and has no pose in rig 8. One frame of the first
// camera's image, one of both.
class RigFramesTest : public ::testing::Test {
 protected:
  RigFramesTest() {
    model_.cameras[1] = {1, 1, 64, 48, {60, 60, 32, 24}};
    model_.cameras[2] = {2, 1, 64, 48, {60, 60, 32, 24}};
    for (const std::uint32_t id : {4u, 5u, 6u}) {
      SparseImage image;
      image.image_id = id;
      image.camera_id = id == 6 ? 2 : 1;
      image.name = std::to_string(id) + ".png";
      const Eigen::Isometry3d pose = (id == 6 ? second_ : first_) * (id == 4 ? frame_a_ : frame_b_);
      image.rotation = Eigen::Quaterniond(pose.rotation());
      image.translation = pose.translation();
      model_.images.push_back(image);
    }
  }

  static Eigen::Isometry3d Make(double angle, const Eigen::Vector3d& translation) {
    return Eigen::Translation3d(translation) *
           Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized());
  }
  static std::string Binary(const Eigen::Isometry3d& p) {
    return Pose(false, Eigen::Quaterniond(p.rotation()), p.translation());
  }
  static std::string Text(const Eigen::Isometry3d& p) {
    return Pose(true, Eigen::Quaterniond(p.rotation()), p.translation());
  }

  void WriteBinary() const {
    const auto sensor = [](int type, std::uint32_t id) { return Bytes(std::int32_t{type}) + Bytes(id); };
    const std::string known = Bytes(std::uint8_t{1}), unknown = Bytes(std::uint8_t{0});
    WriteSparseModelBinary(model_, folder_ / "sparse");
    WriteBytes(folder_ / "sparse/rigs.bin", Bytes(std::uint64_t{2}) + Bytes(8u) + Bytes(2u) + sensor(0, 1) +
                                                sensor(0, 2) + unknown + Bytes(7u) + Bytes(3u) +
                                                sensor(1, 1) + sensor(0, 1) + known + Binary(first_) +
                                                sensor(0, 2) + known + Binary(second_));
    WriteBytes(folder_ / "sparse/frames.bin",
               Bytes(std::uint64_t{2}) + Bytes(1u) + Bytes(7u) + Binary(frame_a_) + Bytes(2u) + sensor(1, 1) +
                   Bytes(std::uint64_t{4}) + sensor(0, 1) + Bytes(std::uint64_t{4}) + Bytes(2u) + Bytes(7u) +
                   Binary(frame_b_) + Bytes(2u) + sensor(0, 1) + Bytes(std::uint64_t{5}) + sensor(0, 2) +
                   Bytes(std::uint64_t{6}));
  }
  void WriteText() const {
    WriteSparseModelText(model_, folder_ / "sparse");
    WriteBytes(folder_ / "sparse/rigs.txt", "# RIG_ID, ...\n\n7 3 IMU 1 CAMERA 1 1 " + Text(first_) +
                                                "CAMERA 2 1 " + Text(second_) +
                                                "\n8 2 CAMERA 1 CAMERA 2 0\r\n");
    WriteBytes(folder_ / "sparse/frames.txt", "1 7 " + Text(frame_a_) + "2 IMU 1 4 CAMERA 1 4\n2 7 " +
                                                  Text(frame_b_) + "2 CAMERA 1 5 CAMERA 2 6\n");
  }
  std::string Warning() const { return FramesWarning(folder_ / "sparse", model_); }

  const TemporaryFolder folder_;
  SparseModel model_;
  const Eigen::Isometry3d first_ = Make(0.1, {0.1, 0, 0}), second_ = Make(1.2, {-0.1, 0.02, 0.3}),
                          frame_a_ = Make(0.7, {1, 2, 3}), frame_b_ = Make(-0.4, {2, 2, 9});
};

TEST_F(RigFramesTest, ThatTellTheImagesPosesAreNotTold) {
  EXPECT_EQ(Warning(), "");
  WriteBinary();
  EXPECT_EQ(Warning(), "");
  fs::remove_all(folder_ / "sparse");
  WriteText();
  EXPECT_EQ(Warning(), "");
}

// As COLMAP reads them, which makes them unit ones.
TEST_F(RigFramesTest, QuaternionsNeedNotBeOfUnitLength) {
  WriteText();
  const Eigen::Quaterniond q(frame_b_.rotation()), twice(2 * q.w(), 2 * q.x(), 2 * q.y(), 2 * q.z());
  WriteBytes(folder_ / "sparse/frames.txt", "1 7 " + Text(frame_a_) + "2 IMU 1 4 CAMERA 1 4\n2 7 " +
                                                Pose(true, twice, frame_b_.translation()) + "2 CAMERA 1 5 CAMERA 2 6\n");
  EXPECT_EQ(Warning(), "");
}

TEST_F(RigFramesTest, ThatTellOtherPosesAreTold) {
  for (const bool is_binary : {true, false}) {
    fs::remove_all(folder_ / "sparse");
    is_binary ? WriteBinary() : WriteText();
    const std::string suffix = is_binary ? ".bin" : ".txt";
    model_.images[2].translation.x() += 0.001;  // of an extent of 6
    EXPECT_EQ(Warning(),
              (folder_ / "sparse/frames").string() + suffix +
                  ": 1 of 3 images, '6.png' the first, have another pose here than in images" + suffix +
                  ", or none. phimvs takes those of images" + suffix +
                  ", COLMAP 3.12 and later take these; take rigs" + suffix + " and frames" + suffix +
                  " away if images" + suffix +
                  " is right, else write the model anew with colmap model_converter of such a COLMAP");
    model_.images[2].translation.x() -= 0.001;
    model_.images[0].rotation =
        Eigen::AngleAxisd(0.001, Eigen::Vector3d::UnitZ()) * model_.images[0].rotation;
    EXPECT_THAT(Warning(), HasSubstr("'4.png'"));
    model_.images[0].rotation = Eigen::Quaterniond((first_ * frame_a_).rotation());
    model_.images[1].image_id = 9;  // of no frame
    EXPECT_THAT(Warning(), HasSubstr("1 of 3 images, '5.png'"));
    model_.images[1].image_id = 5;
  }
}

TEST_F(RigFramesTest, ThatCannotBeReadAreTold) {
  WriteBinary();
  const std::string cannot = " and rigs.bin do not make a model: ",
                    takes = ". phimvs takes the poses of images.bin";
  fs::resize_file(folder_ / "sparse/frames.bin", 100);
  EXPECT_THAT(Warning(),
              HasSubstr((folder_ / "sparse/frames.bin").string() + cannot + "it ends too early" + takes));
  fs::remove(folder_ / "sparse/frames.bin");
  EXPECT_THAT(Warning(), HasSubstr(cannot + "it cannot be opened" + takes));
}

}  // namespace
}  // namespace colmap_ext

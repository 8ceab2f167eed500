// Poses that were given and not adjusted to the points: photos are moved to their points, and match as if nothing were wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "tests/support/room_run.h"

namespace {

using colmap_ext::SyntheticRoom;
using test_support::ProgramResult;
using test_support::RoomRun;
using test_support::RoomScore;
using test_support::ScoreRoom;
using testing::HasSubstr;
using testing::Not;

constexpr char kOff[] = "image_corrections=0";

SyntheticRoom Room() {
  colmap_ext::SyntheticRoomOptions options;
  options.width = 160;
  options.height = 120;
  options.num_views = 5;
  options.supersampling = 2;
  return colmap_ext::MakeSyntheticRoom(options);
}

// Each camera about its centre, so that its image moves by a pixel and a half or less; the points stay.
SyntheticRoom Turned(SyntheticRoom room) {
  const double pixels[][2] = {{1.5, -0.6}, {-1, 1.2}, {0.4, 1}, {-1.4, -1}, {0.5, 0.3}};
  for (std::size_t i = 0; i < room.model.images.size(); ++i) {
    colmap_ext::SparseImage& image = room.model.images[i];
    const double f = room.model.cameras.at(image.camera_id).params[0];
    const Eigen::Quaterniond turn = Eigen::AngleAxisd(pixels[i][0] / f, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(-pixels[i][1] / f, Eigen::Vector3d::UnitX());
    image.rotation = turn * image.rotation;
    image.translation = turn * image.translation;
  }
  return room;
}

double RawCorrectPercent(const RoomRun& run, const std::vector<std::string>& options, std::string* errors) {
  const ProgramResult result = run.RunStereo(options);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  *errors = result.errors;
  return ScoreRoom(run).RawCorrectPercent();
}

TEST(GivenPoses, PhotosAreMovedToTheirPoints) {
  std::string errors;
  const double adjusted = RawCorrectPercent(RoomRun(Room()), {}, &errors);
  EXPECT_THAT(errors, Not(HasSubstr("beside where their cameras see them")));
  const RoomRun turned(Turned(Room()));
  const double as_they_are = RawCorrectPercent(turned, {"--PhiStereo.rules", kOff}, &errors);
  EXPECT_THAT(errors, Not(HasSubstr("beside where their cameras see them")));
  // What is there was made of photos in other places, and is made again.
  const double moved = RawCorrectPercent(turned, {}, &errors);
  EXPECT_THAT(errors, HasSubstr("the photos show the sparse points "));
  EXPECT_THAT(errors, HasSubstr("stereo moves the photos to them, "));
  EXPECT_THAT(errors, HasSubstr("colmap bundle_adjuster"));
  std::printf("within 0.5 %%: poses adjusted %.1f %%, turned %.1f, and moved %.1f\n", adjusted, as_they_are,
              moved);
  // A map is that of its turned camera, the exact one that of the camera as it was: where a surface is slanted a pixel beside is
  // another depth.
  EXPECT_GT(moved, 4 * as_they_are);
  EXPECT_GT(moved, 0.6 * adjusted);
}

TEST(GivenPoses, TheCheckerSaysSo) {
  for (const bool turned : {false, true}) {
    const RoomRun run(turned ? Turned(Room()) : Room());
    std::vector<std::string> check = {PHIMVS_BINARY, "workspace_checker", "--workspace_path", run.dense().string()};
    const ProgramResult result = test_support::RunProgram(check);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_EQ(result.output.find("at full size the photos show the sparse points ") != std::string::npos, turned) << result.output;
    if (!turned) continue;
    // What is seen may have several causes.
    for (const char* cause : {"colmap bundle_adjuster", "lens model", "rolling shutter"}) EXPECT_THAT(result.output, HasSubstr(cause));
    // At an eighth of the size they are off by less than the stereo mends.
    check.insert(check.end(), {"--PatchMatchStereo.max_image_size", "20"});
    const ProgramResult small = test_support::RunProgram(check);
    EXPECT_THAT(small.output, Not(HasSubstr("the photos show the sparse points ")));
  }
}

// The mistake of who writes images.txt himself: poses from camera to world.
SyntheticRoom Inverted(SyntheticRoom room, std::size_t num_images) {
  for (std::size_t i = 0; i < num_images; ++i) {
    colmap_ext::SparseImage& image = room.model.images[i];
    image.rotation = image.rotation.conjugate();
    image.translation = -(image.rotation * image.translation);
  }
  return room;
}

TEST(GivenPoses, PointsBehindTheCamerasAreToldOf) {
  constexpr char kTold[] =
      " have most of their sparse points behind the camera or far outside the photo, and depths will be "
      "wrong: "
      "poses must be world to camera";
  const RoomRun all(Inverted(Room(), 5)), one(Inverted(Room(), 1)), none(Room());
  EXPECT_THAT(all.RunStereo().errors, HasSubstr(kTold));
  for (const auto& [run, told] : {std::pair{&one, true}, {&none, false}}) {
    const ProgramResult result = test_support::RunProgram(
        {PHIMVS_BINARY, "workspace_checker", "--workspace_path", run->dense().string()});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_EQ((result.output + result.errors).find("1 of 5 images, ") != std::string::npos, told)
        << result.output;
    EXPECT_EQ((result.output + result.errors).find(kTold) != std::string::npos, told) << result.output;
  }
}

}  // namespace

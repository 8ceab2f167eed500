#include "colmap_ext/evaluation/map_evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "colmap_ext/evaluation/truth_coverage.h"
#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/sparse_model.h"
#include "phi/base/error.h"
#include "tests/support/error_message.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using phi::Array2D;
using phi::Vec3f;
using test_support::InputErrorOf;
using test_support::TemporaryFolder;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(ScoreDepth, CountsPixelsWithTruthOnly) {
  Array2D<float> truth(10, 1, 2.0f), depth(10, 1, 2.015f);
  truth(0, 0) = truth(1, 0) = 0;  // no truth: eight pixels count
  depth(2, 0) = depth(3, 0) = 0;  // no depth
  depth(4, 0) = 2.5f;
  const MapScore score = ScoreDepth(depth, truth, {0.01, 0.02, 1});
  EXPECT_NEAR(score.valid, 75, 1e-9);
  EXPECT_THAT(score.within, ElementsAre(0, DoubleNear(62.5, 1e-9), DoubleNear(75, 1e-9)));
}

// Of other programs, whose division by a disparity of 0 is no measurement.
TEST(ScoreDepth, WhatIsNotFiniteIsNoDepth) {
  Array2D<float> truth(4, 1, 2.0f), depth(4, 1, 2.0f);
  depth(0, 0) = std::numeric_limits<float>::infinity();
  depth(1, 0) = std::numeric_limits<float>::quiet_NaN();
  truth(2, 0) = std::numeric_limits<float>::infinity();
  const MapScore score = ScoreDepth(depth, truth, {0.01});
  EXPECT_NEAR(score.valid, 100.0 / 3, 1e-9);
  EXPECT_THAT(score.within, ElementsAre(DoubleNear(100.0 / 3, 1e-9)));

  Array2D<Vec3f> true_normals(2, 1, {0, 0, -1}), normals = true_normals;
  normals(0, 0).z = -std::numeric_limits<float>::infinity();
  EXPECT_EQ(ScoreNormals(normals, true_normals, {5}).valid, 50);
}

TEST(ReadTruthDepth, WhatIsNotFiniteIsNoTruth) {
  const TemporaryFolder folder;
  Array2D<float> truth(2, 1, 3.0f);
  truth(0, 0) = std::numeric_limits<float>::infinity();
  WriteDepthMap(folder / "a.png.bin", truth);
  const Array2D<float> read = ReadTruthDepth(folder / "a.png.bin", 1000);
  EXPECT_EQ(read(0, 0), 0);
  EXPECT_EQ(read(1, 0), 3);
}

TEST(ScoreDepth, CountsMeasuredAndInferredPixelsApart) {
  Array2D<float> truth(8, 1, 2.0f), depth(8, 1, 2.0f);
  FilledMask filled(8, 1);
  filled(0, 0) = filled(1, 0) = filled(2, 0) = 255;
  filled(3, 0) = 128;    // inferred too, with no measurement to confirm it
  depth(1, 0) = 2.03f;   // inferred, right at 0.05
  depth(2, 0) = 2.5f;    // inferred, wrong
  truth(3, 0) = 0;       // inferred, no truth
  depth(4, 0) = 2.015f;  // measured, right at 0.02
  depth(5, 0) = 0;       // measured nothing; 6 and 7 are exact
  const MapScore score = ScoreDepth(depth, truth, {0.01, 0.02, 0.05}, &filled);
  ASSERT_TRUE(score.measured && score.inferred);
  EXPECT_EQ(score.inferred->num_pixels, 3);
  EXPECT_THAT(score.inferred->num_within, ElementsAre(1, 1, 2));
  EXPECT_EQ(score.measured->num_pixels, 3);
  EXPECT_THAT(score.measured->num_within, ElementsAre(2, 3, 3));
  EXPECT_NEAR(score.valid, 100.0 * 6 / 7, 1e-9);
  EXPECT_NEAR(score.within[1], 100.0 * 4 / 7, 1e-9);
  EXPECT_FALSE(ScoreDepth(depth, truth, {0.01}).inferred);
}

TEST(ScoreDepth, ReadsASmallerMapAtTheNearestPixel) {
  Array2D<float> truth(4, 4, 1.0f), depth(2, 2, 1.0f);
  depth(1, 1) = 3;
  EXPECT_THAT(ScoreDepth(depth, truth, {0.1}).within, ElementsAre(75));
}

TEST(ScoreNormals, MeasuresAngles) {
  const auto tilted = [](double degrees) {
    const double a = degrees * std::acos(-1.0) / 180;
    return Vec3f{static_cast<float>(std::sin(a)), 0, static_cast<float>(-std::cos(a))};
  };
  Array2D<Vec3f> truth(4, 1, {0, 0, -1}), normals(4, 1);
  normals(0, 0) = tilted(0.5);
  normals(1, 0) = tilted(8);
  normals(2, 0) = tilted(25);  // the fourth has none
  const MapScore score = ScoreNormals(normals, truth, {5, 10, 30});
  EXPECT_THAT(score.within, ElementsAre(25, 50, 75));
  EXPECT_EQ(score.valid, 75);
}

TEST(EvaluateDepthMaps, ReadsPngTruthInItsUnitsAndCountsMissingMapsAsEmpty) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "truth/left");
  cv::imwrite((folder / "truth/left/a.jpg.png").string(), cv::Mat(2, 3, CV_16UC1, cv::Scalar(8000)));
  cv::imwrite((folder / "truth/b.jpg.png").string(), cv::Mat(2, 3, CV_16UC1, cv::Scalar(8000)));
  WriteDepthMap(folder / "maps/left/a.jpg.geometric.bin", Array2D<float>(3, 2, 2.0f));
  MapEvaluationOptions options;
  options.maps = folder / "maps";
  options.truth = folder / "truth";
  options.values_per_unit = 4000;
  options.thresholds = {0.01};
  const MapScores scores = EvaluateDepthMaps(options);
  ASSERT_EQ(scores.images.size(), 2u);
  EXPECT_EQ(scores.images[0].image, "b.jpg");
  EXPECT_FALSE(scores.images[0].found);
  EXPECT_EQ(scores.images[1].within[0], 100);
  EXPECT_EQ(scores.Mean().within[0], 50);
  options.kind = "photometric";
  EXPECT_THROW(EvaluateDepthMaps(options), phi::InputError);
}

// 100 x 75 is half of 200 x 150; 100 x 74 is that, too, but for rounding.
TEST(EvaluateMaps, TruthOfAnotherShapeIsAnErrorThatNamesBothSizes) {
  const TemporaryFolder folder;
  MapEvaluationOptions options;
  options.maps = folder / "maps";
  options.truth = folder / "truth";
  options.thresholds = {0.01};
  const std::filesystem::path map = folder / "maps/a.jpg.geometric.bin", truth = folder / "truth/a.jpg.bin";
  const auto other_shape = testing::AllOf(HasSubstr(map.string() + " is 100x75"), HasSubstr(truth.string() + " is 200x100"));

  WriteDepthMap(map, Array2D<float>(100, 75, 2.0f));
  WriteDepthMap(truth, Array2D<float>(200, 100, 2.0f));
  EXPECT_THAT(InputErrorOf([&] { EvaluateDepthMaps(options); }), other_shape);
  for (const int height : {75, 74}) {
    WriteDepthMap(map, Array2D<float>(100, height, 2.0f));
    WriteDepthMap(truth, Array2D<float>(200, 150, 2.0f));
    EXPECT_EQ(EvaluateDepthMaps(options).Mean().valid, 100);
  }

  WriteNormalMap(map, Array2D<Vec3f>(100, 75, {0, 0, -1}));
  WriteNormalMap(truth, Array2D<Vec3f>(200, 100, {0, 0, -1}));
  EXPECT_THAT(InputErrorOf([&] { EvaluateNormalMaps(options); }), other_shape);
  WriteNormalMap(truth, Array2D<Vec3f>(200, 150, {0, 0, -1}));
  EXPECT_EQ(EvaluateNormalMaps(options).Mean().valid, 100);
}

TEST(EvaluateDepthMaps, ReadsTheFilledMasksBesideTheMaps) {
  const TemporaryFolder folder;
  MapEvaluationOptions options;
  options.maps = folder / "stereo/depth_maps/";  // as a shell completes it
  options.truth = folder / "truth";
  options.thresholds = {0.01};
  options.inferred_apart = true;
  for (const char* name : {"a.jpg", "left/b.jpg"}) {
    std::filesystem::create_directories((folder / "truth" / name).parent_path());
    cv::imwrite((folder / "truth" / (std::string(name) + ".png")).string(),
                cv::Mat(2, 3, CV_16UC1, cv::Scalar(2000)));
    WriteDepthMap(options.maps / (std::string(name) + ".geometric.bin"), Array2D<float>(3, 2, 2.0f));
  }
  EXPECT_THROW(EvaluateDepthMaps(options), phi::InputError);  // no folder filled_masks

  const std::filesystem::path masks = folder / "stereo/filled_masks";
  std::filesystem::create_directories(masks / "left");
  cv::Mat filled(2, 3, CV_8UC1, cv::Scalar(0));
  filled.at<std::uint8_t>(1, 2) = 255;
  cv::imwrite((masks / "left/b.jpg.png").string(), filled);
  const MapScores scores = EvaluateDepthMaps(options);
  ASSERT_EQ(scores.images.size(), 2u);
  EXPECT_EQ(scores.images[0].inferred->num_pixels, 0);  // a.jpg has no mask
  EXPECT_EQ(scores.images[1].inferred->num_pixels, 1);
  EXPECT_EQ(scores.Mean().inferred->num_pixels, 1);
  EXPECT_EQ(scores.Mean().measured->num_pixels, 11);
  EXPECT_THAT(scores.Mean().measured->num_within, ElementsAre(11));

  cv::imwrite((masks / "a.jpg.png").string(), cv::Mat(2, 2, CV_8UC1, cv::Scalar(0)));
  EXPECT_THROW(EvaluateDepthMaps(options), phi::InputError);  // of another size than the map
}

TEST(CoveredByTruth, ProjectsWithPixelCentresAtHalves) {
  const TemporaryFolder folder;
  SparseModel model;
  model.cameras[1] = {1, 1, 4, 2, {2, 2, 2, 1}};  // 4 x 2 pixels, f = 2, centre (2, 1)
  SparseImage image;
  image.image_id = 1;
  image.camera_id = 1;
  image.name = "a.png";
  model.images.push_back(image);
  std::filesystem::create_directories(folder / "dense/sparse");
  WriteSparseModelBinary(model, folder / "dense/sparse");
  Array2D<float> truth(4, 2);
  truth(2, 1) = 5;  // pixel x in [2, 3), y in [1, 2): at depth 1, X in [0, 0.5), Y in [0, 0.5)
  WriteDepthMap(folder / "truth/a.png.bin", truth);
  const std::vector<Vec3f> points{{0.01f, 0.01f, 1},  {0.49f, 0.49f, 1}, {0.51f, 0.01f, 1},
                                  {-0.01f, 0.01f, 1}, {0.98f, 0.98f, 2}, {0.01f, 0.01f, -1},
                                  {9, 9, 1}};
  const std::vector<bool> covered =
      CoveredByTruth(points, Eigen::Vector3d::Zero(), {folder / "dense", folder / "truth", 1000});
  EXPECT_THAT(covered, ElementsAre(true, true, false, false, true, false, false));
  // The same points stored relative to an origin.
  const std::vector<bool> moved =
      CoveredByTruth({{0, 0, 0}}, Eigen::Vector3d(0.25, 0.25, 1), {folder / "dense", folder / "truth", 1000});
  EXPECT_THAT(moved, ElementsAre(true));
  WriteDepthMap(folder / "truth/a.png.bin", Array2D<float>(2, 8, 5.0f));
  EXPECT_THAT(InputErrorOf([&] { CoveredByTruth(points, Eigen::Vector3d::Zero(), {folder / "dense", folder / "truth", 1000}); }),
              HasSubstr("a.png.bin, the truth of a.png: this map is 2x8, which is not the shape of its 4x2 image"));
}

// A surface that was not scanned lies behind the truth of an image that does not see it.
TEST(CoveredByTruth, TruthBeforeAPointCountsWhereTheImageSeesThePoint) {
  const TemporaryFolder folder;
  SparseModel model;
  model.cameras[1] = {1, 1, 4, 2, {2, 2, 2, 1}};
  for (const std::string name : {"a.png", "b.png"}) {  // b has no truth
    SparseImage image;
    image.image_id = static_cast<std::uint32_t>(model.images.size() + 1);
    image.camera_id = 1;
    image.name = name;
    model.images.push_back(image);
  }
  std::filesystem::create_directories(folder / "dense/sparse");
  WriteSparseModelBinary(model, folder / "dense/sparse");
  Array2D<float> truth(4, 2);
  truth(2, 1) = 5;
  WriteDepthMap(folder / "truth/a.png.bin", truth);
  const std::vector<Vec3f> points{
      {0.1f, 0.1f, 8}, {0.1f, 0.1f, 8}, {0.1f, 0.1f, 8}, {0.1f, 0.1f, 3}, {0.1f, 0.1f, 5.04f}};
  const std::vector<std::vector<std::uint32_t>> images{{0}, {1}, {1, 0}, {1}, {1}};
  const auto write_visibility = [&](std::size_t num_points) {
    std::string bytes;
    const auto append = [&](const auto value) {
      bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    append(static_cast<std::uint64_t>(num_points));
    for (std::size_t i = 0; i < num_points; ++i) {
      append(static_cast<std::uint32_t>(images[i].size()));
      for (const std::uint32_t image : images[i]) append(image);
    }
    test_support::WriteBytes(folder / "cloud.ply.vis", bytes);
  };
  write_visibility(points.size());
  CoverageOptions options{folder / "dense", folder / "truth", 1000, {}, 0};
  const auto covered = [&] { return CoveredByTruth(points, Eigen::Vector3d::Zero(), options); };
  EXPECT_THAT(covered(), ElementsAre(true, true, true, true, true));
  options.visibility = folder / "cloud.ply.vis";
  options.hidden_by = 0.05;
  EXPECT_THAT(covered(), ElementsAre(true, false, true, true, true));
  options.hidden_by = 0.03;
  EXPECT_THAT(covered(), ElementsAre(true, false, true, true, false));

  write_visibility(points.size() - 1);
  EXPECT_THROW(covered(), phi::InputError);
  write_visibility(points.size());
  std::filesystem::resize_file(folder / "cloud.ply.vis",
                               std::filesystem::file_size(folder / "cloud.ply.vis") - 4);
  EXPECT_THROW(covered(), phi::InputError);
  std::filesystem::remove(folder / "cloud.ply.vis");
  EXPECT_THAT(InputErrorOf(covered), HasSubstr("cloud.ply.vis is missing"));
}

}  // namespace
}  // namespace colmap_ext

#include "tests/support/small_workspace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "colmap_ext/fusion_config.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/patch_match_config.h"

namespace test_support {

using colmap_ext::kInvalidPoint3D;
using colmap_ext::SparseImage;
using colmap_ext::SparseModel;
using colmap_ext::SparsePoint;

SparseModel SmallModel() {
  SparseModel model;
  model.cameras[1] = {1, 1, 32, 24, {30, 31, 16, 12}};
  model.cameras[4] = {4, 0, 20, 10, {25, 10, 5}};
  SparseImage a;
  a.image_id = 7;
  a.translation = {0.5, -0.25, 2};
  a.camera_id = 1;
  a.name = "a.png";
  a.observations = {{1.5, 2.5, 11}, {3.5, 4.5, kInvalidPoint3D}, {5.5, 6.5, 12}};
  SparseImage b = a;
  b.image_id = 3;
  b.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  b.translation = {1, 2, 3};
  b.name = "sub folder/b \xC3\xA9.png";
  b.observations = {{7.5, 8.5, 11}};
  SparseImage c = a;
  c.image_id = 9;
  c.rotation = Eigen::Quaterniond(0, 1, 0, 0);
  c.camera_id = 4;
  c.name = "c.png";
  c.observations = {};
  model.images = {a, b, c};
  model.points = {SparsePoint{11, {1, -2, 4}, {10, 20, 255}, 0.75, {{7, 0}, {3, 0}}},
                  SparsePoint{12, {0.125, 8, 16}, {0, 1, 2}, 1.25, {{7, 2}}}};
  return model;
}

void WriteSmallWorkspace(const std::filesystem::path& folder) {
  const SparseModel model = SmallModel();
  colmap_ext::WriteSparseModelBinary(model, folder / "sparse");
  std::vector<std::string> names;
  for (const SparseImage& image : model.images) {
    const auto& camera = model.cameras.at(image.camera_id);
    phi::GrayImage pixels(static_cast<int>(camera.width), static_cast<int>(camera.height));
    for (int y = 0; y < pixels.height(); ++y) {
      for (int x = 0; x < pixels.width(); ++x) pixels(x, y) = static_cast<std::uint8_t>(7 * x + 3 * y);
    }
    colmap_ext::WriteGrayImage(folder / "images" / image.name, pixels);
    names.push_back(image.name);
  }
  colmap_ext::WritePatchMatchConfig(folder / "stereo/patch-match.cfg", names, 20);
  colmap_ext::WriteFusionConfig(folder / "stereo/fusion.cfg", names);
}

namespace {

void ExpectSameImage(const SparseImage& a, const SparseImage& b, double tolerance) {
  SCOPED_TRACE("image " + std::to_string(a.image_id));
  EXPECT_EQ(a.image_id, b.image_id);
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.camera_id, b.camera_id);
  // q and -q are the same rotation.
  EXPECT_LE((a.rotation.normalized().matrix() - b.rotation.normalized().matrix()).norm(), tolerance);
  EXPECT_LE((a.translation - b.translation).norm(), tolerance);
  ASSERT_EQ(a.observations.size(), b.observations.size());
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    EXPECT_EQ(a.observations[i].x, b.observations[i].x);
    EXPECT_EQ(a.observations[i].y, b.observations[i].y);
    EXPECT_EQ(a.observations[i].point3D_id, b.observations[i].point3D_id);
  }
}

void ExpectSamePoint(const SparsePoint& a, const SparsePoint& b) {
  SCOPED_TRACE("point " + std::to_string(a.point3D_id));
  EXPECT_EQ(a.point3D_id, b.point3D_id);
  EXPECT_EQ(a.xyz, b.xyz);
  EXPECT_EQ(a.rgb, b.rgb);
  EXPECT_EQ(a.error, b.error);
  ASSERT_EQ(a.track.size(), b.track.size());
  for (std::size_t i = 0; i < a.track.size(); ++i) {
    EXPECT_EQ(a.track[i].image_id, b.track[i].image_id);
    EXPECT_EQ(a.track[i].observation_index, b.track[i].observation_index);
  }
}

void SortById(SparseModel* model) {
  std::sort(model->images.begin(), model->images.end(),
            [](const SparseImage& a, const SparseImage& b) { return a.image_id < b.image_id; });
  std::sort(model->points.begin(), model->points.end(),
            [](const SparsePoint& a, const SparsePoint& b) { return a.point3D_id < b.point3D_id; });
}

}  // namespace

void ExpectSameModel(const SparseModel& a, const SparseModel& b, double tolerance) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (const auto& [id, camera] : a.cameras) {
    SCOPED_TRACE("camera " + std::to_string(id));
    ASSERT_TRUE(b.cameras.contains(id));
    const auto& other = b.cameras.at(id);
    EXPECT_EQ(camera.model_id, other.model_id);
    EXPECT_EQ(camera.width, other.width);
    EXPECT_EQ(camera.height, other.height);
    EXPECT_EQ(camera.params, other.params);
  }
  SparseModel sorted_a = a, sorted_b = b;
  SortById(&sorted_a);
  SortById(&sorted_b);
  ASSERT_EQ(a.images.size(), b.images.size());
  for (std::size_t i = 0; i < a.images.size(); ++i) {
    ExpectSameImage(sorted_a.images[i], sorted_b.images[i], tolerance);
  }
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) ExpectSamePoint(sorted_a.points[i], sorted_b.points[i]);
}

}  // namespace test_support

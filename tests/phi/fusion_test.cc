// Fusion of exact maps: every point lies on the surface that the maps were made from, and every patch has one.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "phi/base/random.h"
#include "phi/fusion/image_fusion.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/scene_fusers.h"

namespace phi {
namespace {

using test_support::MakeFuser;
using test_support::MakeMaps;
using test_support::PlaneScene;
using test_support::RenderedScene;
using test_support::SphereScene;

FusedBlock FuseAll(const RenderedScene& scene, const FusionOptions& options, std::vector<FusionMap>* maps,
                   int rows_per_block = 1 << 20) {
  FusedBlock all;
  for (std::size_t i = 0; i < maps->size(); ++i) {
    ImageFuser fuser = MakeFuser(scene, i, options, maps);
    const int height = (*maps)[i].height();
    const auto append = [&](const FusedBlock& block) {
      all.points.insert(all.points.end(), block.points.begin(), block.points.end());
      all.views.insert(all.views.end(), block.views.begin(), block.views.end());
      all.view_counts.insert(all.view_counts.end(), block.view_counts.begin(), block.view_counts.end());
      all.outcomes += block.outcomes;
    };
    for (int row = 0; row < height; row += rows_per_block)
      append(fuser.FuseRows(row, std::min(row + rows_per_block, height)));
    for (int row = 0; row < height; row += rows_per_block)
      append(fuser.FillHoles(row, std::min(row + rows_per_block, height)));
  }
  return all;
}

Eigen::Vector3d Position(const FusedPoint& point) { return {point.xyz[0], point.xyz[1], point.xyz[2]}; }

TEST(PackedNormal, KeepsDirectionsOfTheWholeSphere) {
  for (double theta = 0; theta <= M_PI; theta += 0.1) {
    for (double phi = -M_PI; phi < M_PI; phi += 0.1) {
      const Vec3f n = {static_cast<float>(std::sin(theta) * std::cos(phi)),
                       static_cast<float>(std::sin(theta) * std::sin(phi)),
                       static_cast<float>(std::cos(theta))};
      const Vec3f back = UnpackNormal(PackNormal(n));
      EXPECT_NEAR(Norm(back), 1, 1e-6);
      EXPECT_LT(Norm(back - n), 1e-4) << theta << " " << phi;  // 0.006 degrees
    }
  }
}

// The widest of the angles at which the agreeing images see a point with the reference, by the cameras' places.
TEST(Fusion, APointsTermsKnowTheWidestAngle) {
  const RenderedScene scene = PlaneScene({.num_views = 4});
  std::vector<FusionMap> maps = MakeMaps(scene);
  FusionOptions options;
  options.keeps_terms = true;
  ImageFuser fuser = MakeFuser(scene, 0, options, &maps);
  const FusedBlock block = fuser.FuseRows(20, 100);
  ASSERT_GT(block.points.size(), 5000u);
  ASSERT_EQ(block.terms.size(), block.points.size());
  const auto ray = [&](std::uint32_t view, const Eigen::Vector3d& x) { return (x - scene.views[view].camera.pose.Center()).normalized(); };
  const std::uint32_t* views = block.views.data();
  for (std::size_t i = 0; i < block.points.size(); views += block.view_counts[i++]) {
    const Eigen::Vector3d x = Position(block.points[i]);
    double widest = 0;
    for (std::uint32_t k = 1; k < block.view_counts[i]; ++k) {
      widest = std::max(widest, std::acos(ray(views[0], x).dot(ray(views[k], x))) * 180 / M_PI);
    }
    ASSERT_NEAR(block.terms[i][kPointAngle], std::log2(0.3 + widest), 0.01) << i;
  }
}

TEST(Fusion, PointsOfAPlaneLieOnItWithItsNormal) {
  const Eigen::Vector3d n = Eigen::Vector3d(0.4, -0.2, -1).normalized();
  const RenderedScene scene = PlaneScene({}, n);
  std::vector<FusionMap> maps = MakeMaps(scene);
  const FusedBlock cloud = FuseAll(scene, {}, &maps);
  ASSERT_GT(cloud.points.size(), 0u);
  for (const FusedPoint& point : cloud.points) {
    ASSERT_NEAR(n.dot(Position(point) - Eigen::Vector3d(0, 0, 4)), 0, 2e-5);
    ASSERT_NEAR(n.dot(Eigen::Vector3d(point.normal[0], point.normal[1], point.normal[2])), 1, 1e-6);
  }
}

// All five views see nearly the same part of the plane: one point for each pixel of one view, and a few more where the
// views' borders differ.
TEST(Fusion, CoversASurfaceOnceWithoutHoles) {
  const RenderedScene scene = PlaneScene();
  std::vector<FusionMap> maps = MakeMaps(scene);
  const FusedBlock cloud = FuseAll(scene, {}, &maps);
  const auto pixels = static_cast<double>(maps[0].size());
  EXPECT_GT(static_cast<double>(cloud.points.size()), pixels);
  EXPECT_LT(static_cast<double>(cloud.points.size()), 1.6 * pixels);

  // In each view, every pixel that another view sees too has a point within two pixels of it.
  for (std::size_t i = 0; i < maps.size(); ++i) {
    Array2D<char> near(maps[i].width(), maps[i].height(), 0);
    const Pinhole& k = scene.views[i].camera.pinhole;
    for (const FusedPoint& point : cloud.points) {
      const Eigen::Vector3d x = scene.views[i].camera.pose * Position(point);
      const int u = static_cast<int>(std::floor(k.fx * x.x() / x.z() + k.cx));
      const int v = static_cast<int>(std::floor(k.fy * x.y() / x.z() + k.cy));
      for (int dv = -2; dv <= 2; ++dv) {
        for (int du = -2; du <= 2; ++du) {
          if (near.view().Contains(u + du, v + dv)) near(u + du, v + dv) = 1;
        }
      }
    }
    const Array2D<int> others = colmap_ext::CountOtherViews(scene, static_cast<int>(i));
    for (int y = 0; y < near.height(); ++y) {
      for (int x = 0; x < near.width(); ++x)
        ASSERT_TRUE(others(x, y) == 0 || near(x, y)) << i << " " << x << " " << y;
    }
  }
}

// Noise of the size of the tolerances: every test passes here and fails there.
void AddNoise(std::vector<FusionMap>* maps) {
  for (std::size_t m = 0; m < maps->size(); ++m) {
    FusionMap& map = (*maps)[m];
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Random4 random = Philox({5, static_cast<std::uint32_t>(m)}, i, 0, 0);
      FusionPixel& pixel = map.data()[i];
      pixel.depth *= 1 + 0.01f * SymmetricFloat(random.v[0]);
      const Vec3f tilt = {0.5f * SymmetricFloat(random.v[1]), 0.5f * SymmetricFloat(random.v[2]), 0};
      pixel.normal = PackNormal(Normalized(UnpackNormal(pixel.normal) + tilt));
    }
  }
}

TEST(Fusion, BlocksOfRowsDoNotChangeTheResult) {
  const RenderedScene scene = SphereScene();
  std::vector<FusionMap> maps = MakeMaps(scene);
  AddNoise(&maps);
  const std::vector<FusionMap> noisy = maps;
  const FusedBlock whole = FuseAll(scene, {}, &maps);
  maps = noisy;
  ASSERT_LT(FuseAll(scene, {.max_normal_error_in_holes = 0}, &maps).points.size(), whole.points.size());
  for (const int rows : {1, 7, 64}) {
    maps = noisy;
    const FusedBlock split = FuseAll(scene, {}, &maps, rows);
    ASSERT_EQ(split.points.size(), whole.points.size());
    EXPECT_EQ(split.views, whole.views);
    EXPECT_EQ(split.view_counts, whole.view_counts);
    for (std::size_t i = 0; i < whole.points.size(); ++i) {
      ASSERT_EQ(std::memcmp(split.points[i].xyz, whole.points[i].xyz, sizeof(double[3])), 0);
    }
  }
}

TEST(Fusion, InstructionSetsAgreeToTheBit) {
  const RenderedScene scene = SphereScene();
  std::vector<FusionMap> maps = MakeMaps(scene);
  AddNoise(&maps);
  const std::vector<FusionMap> noisy = maps;
  const FusedBlock best = FuseAll(scene, {}, &maps);
  EXPECT_GT(best.points.size(), 100u);
  for (const std::int64_t target : {HWY_SCALAR, HWY_SSE4, HWY_AVX2, HWY_AVX3}) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    maps = noisy;
    const FusedBlock other = FuseAll(scene, {}, &maps);
    hwy::SetSupportedTargetsForTest(0);
    ASSERT_EQ(other.points.size(), best.points.size()) << hwy::TargetName(target);
    EXPECT_EQ(other.views, best.views) << hwy::TargetName(target);
    for (std::size_t i = 0; i < best.points.size(); ++i) {
      ASSERT_EQ(std::memcmp(other.points[i].xyz, best.points[i].xyz, sizeof(double[3])), 0);
      ASSERT_EQ(std::memcmp(other.points[i].normal, best.points[i].normal, sizeof(float[3])), 0);
    }
  }
}

TEST(Fusion, LeavesOutWhatNoOtherImageConfirms) {
  const RenderedScene scene = PlaneScene();
  std::vector<FusionMap> maps = MakeMaps(scene);
  maps[2](80, 60).depth *= 0.7f;  // floats before the plane: the others see through it
  maps[2](90, 60).depth *= 1.3f;  // behind it
  maps[2](100, 60).normal = PackNormal({1, 0, 0});
  const auto outcome_of = [&](int x, int y) {
    // A row at a time, with every other pixel empty.
    std::vector<FusionMap> copy = maps;
    for (int c = 0; c < copy[2].width(); ++c) {
      if (c != x) copy[2](c, y).depth = 0;
    }
    const FusedBlock block = MakeFuser(scene, 2, {}, &copy).FuseRows(y, y + 1);
    for (int o = 0; o < kNumPixelOutcomes; ++o) {
      const auto outcome = static_cast<PixelOutcome>(o);
      if (outcome != PixelOutcome::kNoDepth && block.outcomes[outcome] > 0) return outcome;
    }
    return PixelOutcome::kNoDepth;
  };
  EXPECT_EQ(outcome_of(70, 60), PixelOutcome::kFused);  // no earlier image has been fused here
  EXPECT_EQ(outcome_of(80, 60), PixelOutcome::kDepth);
  EXPECT_EQ(outcome_of(90, 60), PixelOutcome::kDepth);
  EXPECT_EQ(outcome_of(100, 60), PixelOutcome::kNormal);
}

TEST(Fusion, CountsViewsAndAsksForEnough) {
  const RenderedScene scene = PlaneScene();
  std::vector<FusionMap> maps = MakeMaps(scene);
  FusionOptions options;
  options.min_num_views = 5;
  const FusedBlock cloud = FuseAll(scene, options, &maps);
  ASSERT_GT(cloud.points.size(), 0u);
  for (const std::uint32_t count : cloud.view_counts) ASSERT_EQ(count, 5u);
  EXPECT_EQ(std::vector<std::uint32_t>(cloud.views.begin(), cloud.views.begin() + 5),
            (std::vector<std::uint32_t>{0, 1, 2, 3, 4}));
  maps = MakeMaps(scene);
  options.min_num_views = options.max_num_views = 6;
  EXPECT_EQ(FuseAll(scene, options, &maps).points.size(), 0u);
}

TEST(Fusion, TakesTheMiddleOfDisagreeingDepths) {
  const RenderedScene scene = PlaneScene({}, {0, 0, -1});  // z = 4
  std::vector<FusionMap> maps = MakeMaps(scene);
  const float factors[5] = {1.006f, 0.998f, 1.0f, 1.002f, 1.0f};
  for (std::size_t i = 0; i < maps.size(); ++i) {
    for (FusionPixel& pixel : maps[i]) pixel.depth *= factors[i];
  }
  const FusedBlock block = MakeFuser(scene, 0, {}, &maps).FuseRows(60, 61);
  ASSERT_GT(block.points.size(), 0u);
  for (const FusedPoint& point : block.points)
    EXPECT_NEAR(point.xyz[2], 4, 4 * 0.002);  // not 4.024, view 0's depth
}

TEST(Fusion, KeepsTheFinerSamplingOfTheNearerCamera) {
  // Two cameras before the plane z = 4: one at z = 0, one at z = 2 with half the footprint, fused second.
  RenderedScene scene = PlaneScene({.num_views = 2}, {0, 0, -1});
  scene.views[1].camera = scene.views[0].camera;
  scene.views[1].camera.pose.translation = {0, 0, -2};
  std::vector<FusionMap> maps = MakeMaps(scene);
  for (FusionPixel& pixel : maps[1]) pixel = {2, PackNormal({0, 0, -1}), {0, 0, 0}, 0};
  FuseAll(scene, {}, &maps);
  // Seen from the near camera, all its pixels that the far one sees give points although those were covered coarsely.
  FusedBlock near = MakeFuser(scene, 1, {}, &maps).FuseRows(60, 61);
  EXPECT_EQ(near.outcomes[PixelOutcome::kFused], maps[1].width());
  // The far camera's pixels are covered by the near one's when that comes first.
  std::swap(maps[0], maps[1]);
  std::swap(scene.views[0], scene.views[1]);
  for (FusionMap& map : maps) {
    for (FusionPixel& pixel : map) pixel.flags = 0;
  }
  FuseAll(scene, {}, &maps);
  const FusedBlock far = MakeFuser(scene, 1, {}, &maps).FuseRows(60, 61);
  EXPECT_EQ(far.outcomes[PixelOutcome::kFused], 0);
  EXPECT_GT(far.outcomes[PixelOutcome::kCovered], 70);
}

TEST(Fusion, KeepsTheFinerSamplingOfTheFrontalCamera) {
  // Both cameras are 4 from the point (0, 0, 4) of the plane z = 4: the first sees it at 70 degrees of slant, where its
  // pixels step along the plane by 1 / cos(70 deg) = 2.9 times those of the second, which looks straight at it.
  RenderedScene scene = PlaneScene({.num_views = 2}, {0, 0, -1});
  const double tilt = 70 * M_PI / 180;
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()).toRotationMatrix();
  scene.views[1].camera = scene.views[0].camera;
  scene.views[0].camera.pose.rotation = rotation;
  scene.views[0].camera.pose.translation = Eigen::Vector3d(0, 0, 4) - rotation * Eigen::Vector3d(0, 0, 4);
  std::vector<FusionMap> maps = MakeMaps(scene);
  const Eigen::Vector3d normal = rotation * Eigen::Vector3d(0, 0, -1);
  const RayModel rays = MakeRayModel(scene.views[0].camera.pinhole);
  for (int y = 0; y < maps[0].height(); ++y) {
    for (int x = 0; x < maps[0].width(); ++x) {
      const Vec3f ray = rays.Ray(x + 0.5f, y + 0.5f);
      const double slope = normal.x() * ray.x + normal.y() * ray.y + normal.z();
      maps[0](x, y) = {static_cast<float>(slope < -0.05 ? 4 * normal.z() / slope : 0.0),
                       PackNormal({static_cast<float>(normal.x()), 0, static_cast<float>(normal.z())}),
                       {0, 0, 0},
                       0};
    }
  }
  for (FusionPixel& pixel : maps[1]) pixel = {4, PackNormal({0, 0, -1}), {0, 0, 0}, 0};
  FuseAll(scene, {}, &maps);
  const auto outcome_counts = [&](std::size_t reference, int begin, int end) {
    return MakeFuser(scene, reference, {}, &maps).FuseRows(begin, end).outcomes;
  };
  // The row through the middle: the grazing camera's points do not stand for the frontal camera's pixels around it.
  EXPECT_GT(outcome_counts(1, 60, 61)[PixelOutcome::kFused], 60);
  EXPECT_LT(outcome_counts(1, 60, 61)[PixelOutcome::kCovered], 60);

  // Frontal first, the grazing camera adds next to nothing in the middle: where it is nearer, its steps are the finer ones.
  std::swap(maps[0], maps[1]);
  std::swap(scene.views[0], scene.views[1]);
  for (FusionMap& map : maps) {
    for (FusionPixel& pixel : map) pixel.flags = 0;
  }
  FuseAll(scene, {}, &maps);
  EXPECT_LT(outcome_counts(1, 60, 61)[PixelOutcome::kFused], 6);
  EXPECT_GT(outcome_counts(1, 60, 61)[PixelOutcome::kCovered], 60);
}

TEST(Fusion, AWorldFarFromItsOriginIsAsPrecise) {
  RenderedScene scene = PlaneScene({}, {0, 0, -1});
  colmap_ext::Similarity shift;
  shift.translation = {500000, 4000000, 1000};
  colmap_ext::Transform(shift, &scene);
  std::vector<FusionMap> maps = MakeMaps(scene);
  const FusedBlock cloud = FuseAll(scene, {}, &maps);
  ASSERT_GT(cloud.points.size(), maps[0].size());
  for (const FusedPoint& point : cloud.points) ASSERT_NEAR(point.xyz[2], 1004, 2e-5);
}

TEST(Fusion, InferredWhenMostMeasurementsAre) {
  const RenderedScene scene = PlaneScene({.num_views = 3});
  std::vector<FusionMap> maps = MakeMaps(scene);
  for (FusionPixel& pixel : maps[0]) pixel.flags = FusionPixel::kInferred;
  for (FusionPixel& pixel : maps[1]) pixel.flags = FusionPixel::kInferred;
  const FusedBlock block = MakeFuser(scene, 0, {}, &maps).FuseRows(60, 61);
  ASSERT_GT(block.points.size(), 0u);
  for (std::size_t i = 0; i < block.points.size(); ++i) {
    if (block.view_counts[i] != 3) continue;
    EXPECT_EQ(block.points[i].inferred, 1);
  }
  for (FusionPixel& pixel : maps[0]) pixel.flags = 0;
  const FusedBlock measured = MakeFuser(scene, 0, {}, &maps).FuseRows(60, 61);
  for (std::size_t i = 0; i < measured.points.size(); ++i) {
    if (measured.view_counts[i] != 3) continue;
    EXPECT_EQ(measured.points[i].inferred, 0);
  }
}

TEST(Fusion, AnInferredPixelNeedsMoreSupport) {
  const RenderedScene scene = PlaneScene({.num_views = 2}, {0, 0, -1});
  std::vector<FusionMap> maps;
  const auto outcomes = [&](double degrees, bool inferred, FusionOptions options = {}) {
    maps = MakeMaps(scene);
    const auto angle = static_cast<float>(degrees * M_PI / 180);
    const float c = std::cos(angle), s = std::sin(angle);
    for (FusionPixel& pixel : maps[1]) pixel.normal = PackNormal(Mat3f{{c, 0, s, 0, 1, 0, -s, 0, c}} * UnpackNormal(pixel.normal));
    if (inferred)
      for (FusionPixel& pixel : maps[0]) pixel.flags = FusionPixel::kInferred;
    return MakeFuser(scene, 0, options, &maps).FuseRows(60, 61).outcomes;
  };
  // Depths are the same. The other normal is off by 5 or 7 of 8 degrees. 1 less their cosines, over that of 8 degrees: 0.39 and 0.77, so
  // a support of 1 - 0.39^2 = 0.85, or 0.41.
  EXPECT_GT(outcomes(5, true)[PixelOutcome::kFused], 100);
  EXPECT_EQ(outcomes(7, true)[PixelOutcome::kFused], 0);
  EXPECT_GT(outcomes(7, true)[PixelOutcome::kWeakSupport], 100);
  // A measured pixel needs none, unless asked.
  EXPECT_GT(outcomes(7, false)[PixelOutcome::kFused], 100);
  EXPECT_GT(outcomes(7, false, {.min_support = 0.5})[PixelOutcome::kWeakSupport], 100);
}

TEST(Fusion, APointIsSurerTheMoreImagesAgreeAndTheFewerDoNot) {
  const RenderedScene scene = PlaneScene({.num_views = 4}, {0, 0, -1});
  std::vector<FusionMap> maps = MakeMaps(scene);
  for (FusionMap& map : maps) {
    for (FusionPixel& pixel : map) pixel.flags = FusionPixel::kInferred;  // measured ones would all be at a hundred per cent
  }
  const auto fuse = [&](const FusionOptions& options) {
    std::vector<FusionMap> copy = maps;
    return MakeFuser(scene, 0, options, &copy).FuseRows(60, 61);
  };
  // Of a point that all images look at.
  const auto confidence = [&] {
    const FusedBlock block = fuse({});
    return block.points.empty() ? 0 : static_cast<int>(block.points[block.points.size() / 2].confidence);
  };
  const int all = confidence();
  EXPECT_GT(all, 50);
  for (FusionPixel& pixel : maps[3]) pixel.depth = 0;
  const int three_of_four = confidence();
  EXPECT_LT(three_of_four, all);
  for (FusionPixel& pixel : maps[2]) pixel.depth *= 0.5f;  // hides the point, and says nothing of it
  const int two_of_three = confidence();
  EXPECT_LT(two_of_three, three_of_four);
  for (FusionPixel& pixel : maps[2]) pixel.depth *= 1.96f;  // just before it
  EXPECT_LT(confidence(), two_of_three);
  for (FusionMap& map : maps) {
    for (FusionPixel& pixel : map) pixel.flags = FusionPixel::kInferred;
  }
  const int inferred = confidence();
  EXPECT_GT(inferred, 0);
  EXPECT_LT(inferred, two_of_three);
  const auto num_points = [&](int least) {
    const FusedBlock block = fuse({});
    return std::count_if(block.points.begin(), block.points.end(), [&](const FusedPoint& p) { return p.confidence >= least; });
  };
  const FusedBlock sure = fuse({.min_confidence = inferred / 100.0 + 0.005});  // percents are rounded
  EXPECT_EQ(static_cast<std::ptrdiff_t>(sure.points.size()), num_points(inferred + 1));
  EXPECT_LT(num_points(inferred + 1), num_points(inferred));
  EXPECT_EQ(sure.outcomes[PixelOutcome::kImprobable], num_points(1) - num_points(inferred + 1));
}

TEST(Fusion, AnImageThatSeesThroughOutweighsASingleSupport) {
  const RenderedScene scene = PlaneScene({.num_views = 4}, {0, 0, -1});
  std::vector<FusionMap> maps = MakeMaps(scene);
  for (FusionPixel& pixel : maps[3]) pixel.depth *= 1.3f;
  for (FusionPixel& pixel : maps[2]) pixel.depth = 0;
  const auto outcomes = [&] { return MakeFuser(scene, 0, {}, &maps).FuseRows(60, 61).outcomes; };
  EXPECT_GT(outcomes()[PixelOutcome::kSeenThrough], 100);
  maps[2] = MakeMaps(scene)[2];
  EXPECT_GT(outcomes()[PixelOutcome::kFused], 100);  // two images support it, one sees through
}

TEST(Fusion, OnlyAMeasuredSurfaceIsSeenThroughAPoint) {
  const RenderedScene scene = PlaneScene({.num_views = 3}, {0, 0, -1});
  std::vector<FusionMap> maps = MakeMaps(scene);
  const auto outcomes = [&] { return MakeFuser(scene, 0, {}, &maps).FuseRows(60, 61).outcomes; };
  for (const float factor : {1.05f, 1.3f}) {  // within and beyond what a slant may explain
    for (std::size_t i = 0; i < maps[2].size(); ++i) {
      maps[2].data()[i].depth = factor * maps[0].data()[i].depth;
      maps[2].data()[i].flags = 0;
    }
    EXPECT_GT(outcomes()[PixelOutcome::kSeenThrough], 50) << factor;
    for (FusionPixel& pixel : maps[2]) pixel.flags = FusionPixel::kInferred;
    EXPECT_EQ(outcomes()[PixelOutcome::kSeenThrough], 0) << factor;
    EXPECT_GT(outcomes()[PixelOutcome::kFused], 50) << factor;
  }
}

TEST(Fusion, DropsPointsOutsideTheBox) {
  const RenderedScene scene = PlaneScene();
  std::vector<FusionMap> maps = MakeMaps(scene);
  const BoundingBox box = {{-0.5, -10, 0}, {0.25, 10, 10}};
  ImageFuser fuser = MakeFuser(scene, 0, {}, &maps, &box);
  const FusedBlock block = fuser.FuseRows(0, maps[0].height());
  ASSERT_GT(block.points.size(), 0u);
  EXPECT_GT(block.outcomes[PixelOutcome::kOutsideBox], 0);
  std::size_t num_views = 0;
  for (const std::uint32_t count : block.view_counts) num_views += count;
  EXPECT_EQ(block.views.size(), num_views);
  for (const FusedPoint& point : block.points) {
    ASSERT_GE(point.xyz[0], -0.5);
    ASSERT_LE(point.xyz[0], 0.25);
  }
}

TEST(Fusion, ReprojectionErrorIsThatOfTheDepthDifference) {
  // Two cameras of the same focal length that look along z, one beside the other: a point at depth z and one at 1.006 z on
  // the same ray are seen f * baseline / z * (1 - 1 / 1.006) pixels apart.
  RenderedScene scene = PlaneScene({.num_views = 2}, {0, 0, -1});
  scene.views[1].camera = scene.views[0].camera;
  const double f = scene.views[0].camera.pinhole.fx, baseline = 1.5;
  scene.views[1].camera.pose.translation = {-baseline, 0, 0};
  std::vector<FusionMap> maps = MakeMaps(scene);
  for (FusionPixel& pixel : maps[1]) pixel = {4 * 1.006f, PackNormal({0, 0, -1}), {0, 0, 0}, 0};
  const double error = f * baseline / 4 * (1 - 1 / 1.006);
  const auto num_refused = [&](double max_error) {
    FusionOptions options;
    options.max_reproj_error = max_error;
    return MakeFuser(scene, 0, options, &maps).FuseRows(60, 61).outcomes[PixelOutcome::kReprojection];
  };
  EXPECT_GT(num_refused(0.99 * error), 50);
  EXPECT_EQ(num_refused(1.01 * error), 0);
}

TEST(FusionOptions, NamesTheWrongOption) {
  FusionOptions options;
  EXPECT_EQ(options.Check(), "");
  options.max_depth_error = 0;
  EXPECT_NE(options.Check().find("--StereoFusion.max_depth_error is 0"), std::string::npos);
  options = {};
  options.max_num_views = 1;
  EXPECT_NE(options.Check().find("--StereoFusion.max_num_pixels"), std::string::npos);
  options = {};
  options.max_normal_error_in_holes = 91;
  EXPECT_NE(options.Check().find("--PhiFusion.max_normal_error_in_holes is 91"), std::string::npos);
}

}  // namespace
}  // namespace phi

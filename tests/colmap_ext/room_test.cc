// The synthetic room: exact maps that agree with geometry and with each other, and the stated appearance.
#include "colmap_ext/synthetic/room.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "phi/base/error.h"

namespace {

using colmap_ext::MakeSyntheticRoom;
using colmap_ext::SurfaceId;
using colmap_ext::SyntheticRoom;
using colmap_ext::SyntheticRoomOptions;

SyntheticRoomOptions SmallRoom() {
  SyntheticRoomOptions options;
  options.width = 160;
  options.height = 120;
  options.num_views = 5;
  options.supersampling = 2;
  return options;
}

// No noise, no exposure change, no compression.
SyntheticRoomOptions CleanRoom() {
  SyntheticRoomOptions options = SmallRoom();
  options.noise_sigma = 0;
  options.exposure_jitter = 0;
  options.jpeg_quality = 0;
  return options;
}

double TexturedShare(const colmap_ext::RenderedScene& scene) {
  std::size_t textured = 0, total = 0;
  for (const auto& mask : scene.textured) {
    textured += std::count(mask->begin(), mask->end(), 255);
    total += mask->size();
  }
  return static_cast<double>(textured) / total;
}

Eigen::Vector3d WorldPoint(const colmap_ext::RenderedScene& scene, int view, int x, int y) {
  const colmap_ext::Ray ray = colmap_ext::PixelRay(scene.views[view].camera, x + 0.5, y + 0.5);
  return ray.origin + static_cast<double>((*scene.truth[view])(x, y).depth) * ray.direction;
}

// The back wall is the plane y = 4 m, bare between and above the pictures.
TEST(SyntheticRoom, BackWallIsWhereTheRayMeetsIt) {
  const SyntheticRoom room = MakeSyntheticRoom(SmallRoom());
  const phi::Camera& camera = room.scene.views[2].camera;
  const int x = 80, y = 12;
  const Eigen::Vector3d direction =
      camera.pose.rotation.transpose() *
      Eigen::Vector3d((x + 0.5 - 0.497 * 160) / (0.85 * 160), (y + 0.5 - 0.504 * 120) / (0.853 * 160), 1);
  const double depth = (4.0 - camera.pose.Center().y()) / direction.y();
  const phi::PlaneHypothesis& h = (*room.scene.truth[2])(x, y);
  EXPECT_NEAR(h.depth, depth, 1e-6 * depth);
  const Eigen::Vector3d normal = camera.pose.rotation * Eigen::Vector3d(0, -1, 0);
  EXPECT_NEAR(h.normal.x, normal.x(), 1e-6);
  EXPECT_NEAR(h.normal.y, normal.y(), 1e-6);
  EXPECT_NEAR(h.normal.z, normal.z(), 1e-6);
}

TEST(SyntheticRoom, EveryPixelIsInTheRoomAndFacesItsCamera) {
  const SyntheticRoom room = MakeSyntheticRoom(SmallRoom());
  for (int i = 0; i < 5; ++i) {
    const phi::RayModel k = phi::MakeRayModel(room.scene.views[i].camera.pinhole);
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 160; ++x) {
        const phi::PlaneHypothesis& h = (*room.scene.truth[i])(x, y);
        ASSERT_GT(h.depth, 0.3);
        ASSERT_NEAR(phi::Norm(h.normal), 1, 1e-5);
        ASSERT_LT(phi::Dot(h.normal, k.Ray(x + 0.5f, y + 0.5f)), 0);
        const Eigen::Vector3d p = WorldPoint(room.scene, i, x, y);
        ASSERT_TRUE(p.x() > -1e-5 && p.x() < 5.2 + 1e-5 && p.y() < 4 + 1e-5 && p.z() > -1e-5 &&
                    p.z() < 2.7 + 1e-5);
      }
    }
  }
}

// A plane's depth in another view, extended to where the point falls, is the point's depth there.
TEST(SyntheticRoom, TruthAgreesBetweenViewsOnPlanes) {
  const SyntheticRoom room = MakeSyntheticRoom(SmallRoom());
  const auto& scene = room.scene;
  std::size_t compared = 0;
  for (int i = 0; i < 5; ++i) {
    const int j = (i + 1) % 5;
    const phi::RayModel k = phi::MakeRayModel(scene.views[j].camera.pinhole);
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 160; ++x) {
        const SurfaceId id = (*scene.surfaces[i])(x, y);
        if ((id - 1) % 8 == 6) continue;  // curved
        const Eigen::Vector3d p = colmap_ext::Project(scene.views[j].camera, WorldPoint(scene, i, x, y));
        if (p.x() < 0 || p.y() < 0 || p.x() >= 160 || p.y() >= 120) continue;
        const int xj = static_cast<int>(p.x()), yj = static_cast<int>(p.y());
        if ((*scene.surfaces[j])(xj, yj) != id) continue;
        const float depth = phi::PlaneDepthAt(k, (*scene.truth[j])(xj, yj), xj + 0.5f, yj + 0.5f,
                                              static_cast<float>(p.x()), static_cast<float>(p.y()));
        ASSERT_NEAR(depth, p.z(), 1e-4 * p.z()) << "view " << i << " pixel " << x << ", " << y;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 5 * 160 * 120 / 2);
}

TEST(SyntheticRoom, MostOfEachViewIsSeenByTwoMoreViews) {
  const SyntheticRoom room = MakeSyntheticRoom(SmallRoom());
  for (int i = 0; i < 5; ++i) {
    const phi::Array2D<int> others = colmap_ext::CountOtherViews(room.scene, i);
    const auto seen = std::count_if(others.begin(), others.end(), [](int n) { return n >= 2; });
    EXPECT_GT(seen, 0.85 * 160 * 120) << "view " << i;
  }
}

TEST(SyntheticRoom, TexturedShareIsAsAsked) {
  for (const double share : {0.0, 0.3, 0.55, 1.0}) {
    SyntheticRoomOptions options = SmallRoom();
    options.texture_share = share;
    EXPECT_NEAR(TexturedShare(MakeSyntheticRoom(options).scene), share, 0.01) << share;
  }
}

TEST(SyntheticRoom, DefaultPaintsAtLeast35Percent) {
  EXPECT_LE(TexturedShare(MakeSyntheticRoom(SmallRoom()).scene), 0.65);
}

// Whether all pixels within 1 of (x, y) show the same surface, and the same kind of coat.
bool IsInterior(const colmap_ext::RenderedScene& scene, int view, int x, int y) {
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if ((*scene.surfaces[view])(x + dx, y + dy) != (*scene.surfaces[view])(x, y)) return false;
      if ((*scene.textured[view])(x + dx, y + dy) != (*scene.textured[view])(x, y)) return false;
    }
  }
  return true;
}

TEST(SyntheticRoom, PaintedSurfacesHaveAtMostOneGreyLevelOfContrast) {
  const SyntheticRoom room = MakeSyntheticRoom(CleanRoom());
  std::map<SurfaceId, std::pair<int, int>> range;  // darkest, lightest over all views
  double textured_spread = 0;
  std::size_t textured_count = 0;
  for (int i = 0; i < 5; ++i) {
    for (int y = 1; y < 119; ++y) {
      for (int x = 1; x < 158; ++x) {
        if (!IsInterior(room.scene, i, x, y)) continue;
        const int gray = (*room.scene.images[i])(x, y);
        if ((*room.scene.textured[i])(x, y)) {
          textured_spread += std::abs(gray - (*room.scene.images[i])(x + 1, y));
          ++textured_count;
          continue;
        }
        auto [it, is_new] = range.try_emplace((*room.scene.surfaces[i])(x, y), gray, gray);
        it->second.first = std::min(it->second.first, gray);
        it->second.second = std::max(it->second.second, gray);
      }
    }
  }
  ASSERT_GE(range.size(), 2u);
  for (const auto& [id, limits] : range) EXPECT_LE(limits.second - limits.first, 1) << "surface " << id;
  EXPECT_GT(textured_spread / textured_count, 4) << "neighbouring pixels of textures differ";
}

TEST(SyntheticRoom, HasCurvedAndObliqueSurfacesAndDepthEdges) {
  const SyntheticRoom room = MakeSyntheticRoom(SmallRoom());
  const auto& scene = room.scene;
  std::size_t curved = 0, oblique = 0;
  std::set<std::pair<SurfaceId, SurfaceId>> edges;
  const Eigen::Matrix3d world_from_camera = scene.views[2].camera.pose.rotation.transpose();
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x + 1 < 160; ++x) {
      const SurfaceId id = (*scene.surfaces[2])(x, y), next = (*scene.surfaces[2])(x + 1, y);
      const phi::PlaneHypothesis& h = (*scene.truth[2])(x, y);
      const Eigen::Vector3d n = world_from_camera * Eigen::Vector3d(h.normal.x, h.normal.y, h.normal.z);
      const bool is_curved = (id - 1) % 8 == 6;
      curved += is_curved;
      oblique += !is_curved && n.cwiseAbs().maxCoeff() < 0.97;
      if (std::abs((*scene.truth[2])(x + 1, y).depth - h.depth) > 0.15 * h.depth) edges.insert({id, next});
    }
  }
  EXPECT_GT(curved, 0.02 * 160 * 120);
  EXPECT_GT(oblique, 0.05 * 160 * 120);
  EXPECT_GE(edges.size(), 3u);
}

TEST(SyntheticRoom, SameBytesForOneThreadAndDifferentBytesForAnotherSeed) {
  const SyntheticRoom all = MakeSyntheticRoom(SmallRoom());
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const SyntheticRoom single = MakeSyntheticRoom(SmallRoom());
  EXPECT_EQ(all.image_files, single.image_files);
  ASSERT_EQ(all.model.points.size(), single.model.points.size());
  for (std::size_t i = 0; i < all.model.points.size(); ++i) {
    ASSERT_EQ(all.model.points[i].xyz, single.model.points[i].xyz);
  }
  SyntheticRoomOptions options = SmallRoom();
  options.seed = 1;
  EXPECT_NE(all.image_files, MakeSyntheticRoom(options).image_files);
}

TEST(SyntheticRoom, NoiseAndExposureAreAsAsked) {
  SyntheticRoomOptions options = CleanRoom();
  const SyntheticRoom clean = MakeSyntheticRoom(options);
  options.noise_sigma = 2;
  const SyntheticRoom noisy = MakeSyntheticRoom(options);
  double sum = 0, sum2 = 0;
  const std::size_t count = clean.scene.images[0]->size();
  for (std::size_t i = 0; i < count; ++i) {
    const double d = noisy.scene.images[0]->data()[i] - static_cast<double>(clean.scene.images[0]->data()[i]);
    sum += d;
    sum2 += d * d;
  }
  EXPECT_NEAR(sum / count, 0, 0.1);
  EXPECT_NEAR(std::sqrt(sum2 / count), 2, 0.15);  // rounding adds about 0.06

  options = CleanRoom();
  options.exposure_jitter = 0.05;
  const SyntheticRoom exposed = MakeSyntheticRoom(options);
  std::set<int> gains;
  for (int i = 0; i < 5; ++i) {
    double before = 0, after = 0;
    for (const auto v : *clean.scene.images[i]) before += v;
    for (const auto v : *exposed.scene.images[i]) after += v;
    EXPECT_NEAR(after / before, 1, 0.051);
    gains.insert(static_cast<int>(std::lround(1000 * after / before)));
  }
  EXPECT_GE(gains.size(), 4u) << "each view has its own exposure";
}

TEST(SyntheticRoom, SparsePointsLieOnTexturedPartsWithTheStatedNoise) {
  const SyntheticRoom room = MakeSyntheticRoom(SmallRoom());
  ASSERT_GT(room.model.points.size(), 300u);
  double sum2 = 0;
  std::size_t residuals = 0, painted = 0, observations = 0;
  for (const auto& point : room.model.points) {
    ASSERT_GE(point.track.size(), 3u);
    for (const auto& element : point.track) {
      const int view = static_cast<int>(element.image_id) - 1;
      const auto& seen = room.model.images[view].observations.at(element.observation_index);
      ASSERT_EQ(seen.point3D_id, point.point3D_id);
      const Eigen::Vector3d p = colmap_ext::Project(room.scene.views[view].camera, point.xyz);
      sum2 += (p.head<2>() - Eigen::Vector2d(seen.x, seen.y)).squaredNorm();
      const int x = std::clamp(static_cast<int>(p.x()), 0, 159),
                y = std::clamp(static_cast<int>(p.y()), 0, 119);
      painted += (*room.scene.textured[view])(x, y) == 0;
      ++observations;
    }
    residuals += 2 * point.track.size() - 3;  // degrees of freedom after the fit of three coordinates
  }
  EXPECT_NEAR(std::sqrt(sum2 / residuals), 0.3, 0.03);
  EXPECT_LT(painted, 0.06 * observations)
      << "only points within the noise of an edge may round to a painted pixel";
}

TEST(SyntheticRoom, MovesAsAWhole) {
  SyntheticRoom room = MakeSyntheticRoom(SmallRoom());
  const SyntheticRoom before = room;
  colmap_ext::Similarity motion;
  motion.scale = 3;
  motion.rotation = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  motion.translation = {1e6, -2e6, 3e6};
  colmap_ext::Transform(motion, &room);
  for (std::size_t i = 0; i < room.model.images.size(); ++i) {
    const auto& image = room.model.images[i];
    const Eigen::Vector3d moved = image.rotation * room.model.points[7].xyz + image.translation;
    const Eigen::Vector3d original =
        before.model.images[i].rotation * before.model.points[7].xyz + before.model.images[i].translation;
    EXPECT_NEAR((moved - 3 * original).norm(), 0, 1e-7);
    EXPECT_FLOAT_EQ((*room.scene.truth[i])(3, 4).depth, 3 * (*before.scene.truth[i])(3, 4).depth);
  }
}

TEST(SyntheticRoom, RefusesBadOptions) {
  SyntheticRoomOptions options;
  options.texture_share = 1.5;
  EXPECT_EQ(options.Check(), "--texture_share is 1.5; it must be from 0 to 1");
  EXPECT_THROW(MakeSyntheticRoom(options), phi::UsageError);
}

}  // namespace

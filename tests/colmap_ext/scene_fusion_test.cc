#include "colmap_ext/failure_text.h"
#include "colmap_ext/fusion/cloud_coordinates.h"
#include "colmap_ext/fusion/cloud_files.h"
#include "colmap_ext/fusion/scene_fusion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "colmap_ext/fusion/bounding_box_file.h"
#include "colmap_ext/fusion/fusion_report.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/sparse_model.h"
#include "tests/support/error_message.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/log_capture.h"
#include "tests/support/map_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using phi::PixelOutcome;
using test_support::InputErrorOf;
using test_support::LogCapture;
using test_support::MapWorkspaceImageName;
using test_support::PlaneScene;
using test_support::ReadBytes;
using test_support::SphereScene;
using test_support::TemporaryFolder;
using test_support::WriteMapWorkspace;
using testing::HasSubstr;
using testing::StartsWith;

SceneFusionReport Fuse(const fs::path& folder, SceneFusionOptions options = {},
                       const fs::path& name = "fused.ply", PlyCloudOptions cloud = {}) {
  const Workspace workspace({.path = folder});
  options.scratch_folder = folder;
  cloud.path = folder / name;
  const auto writer = MakePlyCloudWriter(cloud);
  const SceneFusionReport report = FuseScene(workspace, options, writer.get());
  writer->Commit();
  return report;
}

fs::path MapPath(const fs::path& folder, const char* maps, int view) {
  return folder / "stereo" / maps / (MapWorkspaceImageName(view) + ".geometric.bin");
}

struct Vertex {
  float xyz[3], normal[3];
  std::uint8_t rgb[3], views, inferred, confidence;
};

// Independent of the writer but for the format that the documentation promises.
std::vector<Vertex> ReadCloud(const fs::path& path) {
  const std::string bytes = ReadBytes(path);
  const std::size_t end = bytes.find("end_header\n") + 11;
  const std::size_t element = bytes.find("\nelement vertex ");
  std::vector<Vertex> vertices(std::stoul(bytes.substr(element + 16)));
  EXPECT_EQ(bytes.size(), end + vertices.size() * 30);
  for (std::size_t i = 0; i < vertices.size(); ++i)
    std::memcpy(&vertices[i], bytes.data() + end + 30 * i, 30);
  return vertices;
}

TEST(SceneFusion, SameBytesForAnyThreadsAndAnyMemory) {
  const TemporaryFolder folder;
  WriteMapWorkspace(SphereScene({.num_views = 7}), folder.path());
  SceneFusionOptions options;
  options.max_neighbors = 2;
  options.num_threads = 1;
  Fuse(folder.path(), options);
  const std::string cloud = ReadBytes(folder / "fused.ply"), visibility = ReadBytes(folder / "fused.ply.vis");
  EXPECT_GT(cloud.size(), 29u * 160 * 120);
  // 160 x 120 pixels are 0.23 MB a map, and 0.42 MB while one is read: in 1.7 MB not all seven fit.
  bool read_again = false;
  for (const double gigabytes : {0.0017, 0.0}) {
    for (const int threads : {1, 2, 3, 8}) {
      options.num_threads = threads;
      options.max_memory_gb = gigabytes;
      const SceneFusionReport report = Fuse(folder.path(), options);
      read_again |= report.num_map_reads > 7;
      EXPECT_EQ(ReadBytes(folder / "fused.ply") == cloud, true)
          << threads << " threads, " << gigabytes << " GB";
      EXPECT_EQ(ReadBytes(folder / "fused.ply.vis") == visibility, true);
    }
  }
  EXPECT_TRUE(read_again);
}

TEST(SceneFusion, WhichNeighboursFitDoesNotDependOnThreads) {
  const TemporaryFolder folder;
  WriteMapWorkspace(SphereScene({.num_views = 7}), folder.path());
  SceneFusionOptions options;
  options.max_neighbors = 6;
  std::set<std::string> clouds;
  for (int kilobytes = 1500; kilobytes <= 2500; kilobytes += 50) {
    options.max_memory_gb = kilobytes * 1e-6;
    options.num_threads = 1;
    Fuse(folder.path(), options);
    const std::string cloud = ReadBytes(folder / "fused.ply");
    options.num_threads = 8;
    Fuse(folder.path(), options);
    EXPECT_TRUE(ReadBytes(folder / "fused.ply") == cloud) << kilobytes;
    clouds.insert(cloud);
  }
  EXPECT_GT(clouds.size(), 1u) << "the memory matters";
}

TEST(SceneFusion, LessMemoryThanTheProgramTakesLeavesMapsNone) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene(), folder.path());
  SceneFusionOptions options;
  options.max_memory_gb = 1e-6;
  EXPECT_THAT(test_support::MessageOf<phi::ResourceError>([&] { Fuse(folder.path(), options); }), testing::HasSubstr("maps may use 0 GB"));
}

// Whatever a photo's duplicate finds, the photo finds as well: it confirmed every error.
TEST(SceneFusion, ImagesAtOnePlaceDoNotConfirmEachOther) {
  const TemporaryFolder folder;
  RenderedScene scene = PlaneScene({.num_views = 1});
  for (int copy = 0; copy < 2; ++copy) {
    scene.views.push_back(scene.views[0]);
    scene.images.push_back(scene.images[0]);
    scene.truth.push_back(scene.truth[0]);
  }
  scene.views[1].camera.pose.translation.x() = 0.001;  // 0.02 degrees
  WriteMapWorkspace(scene, folder.path());
  const SceneFusionReport report = Fuse(folder.path());
  EXPECT_EQ(report.num_points, 0);
  EXPECT_EQ(report.outcomes[PixelOutcome::kTooFewViews], 3 * 160 * 120);

  // One image for a point is enough, and the others' pixels are covered.
  SceneFusionOptions options;
  options.rule.min_num_views = 1;
  const SceneFusionReport alone = Fuse(folder.path(), options);
  EXPECT_EQ(alone.outcomes[PixelOutcome::kFused], 160 * 120);
  EXPECT_EQ(alone.outcomes[PixelOutcome::kCovered] > 2 * 159 * 119, true);
  for (const Vertex& vertex : ReadCloud(folder / "fused.ply")) ASSERT_EQ(vertex.views, 1);
}

// Of a .vis file: by point, its images' places in the model.
std::vector<std::vector<std::uint32_t>> ReadVisibility(const fs::path& path) {
  const std::string bytes = ReadBytes(path);
  std::uint64_t count = 0;
  std::memcpy(&count, bytes.data(), sizeof(count));
  std::vector<std::vector<std::uint32_t>> points(count);
  std::size_t at = sizeof(count);
  for (auto& views : points) {
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data() + at, sizeof(size));
    views.resize(size);
    std::memcpy(views.data(), bytes.data() + at + sizeof(size), size * sizeof(size));
    at += (1 + size) * sizeof(size);
  }
  EXPECT_EQ(at, bytes.size());
  return points;
}

// COLMAP's converters and versions write the images of one model in several orders.
TEST(SceneFusion, TheOrderInWhichTheModelListsImagesChangesNoPoint) {
  const TemporaryFolder folder;
  WriteMapWorkspace(SphereScene({.num_views = 7}), folder.path());
  SceneFusionOptions options;
  options.max_neighbors = 2;
  Fuse(folder.path(), options);
  const std::string cloud = ReadBytes(folder / "fused.ply");
  auto views = ReadVisibility(folder / "fused.ply.vis");
  SparseModel model = ReadSparseModel(folder / "sparse");
  std::reverse(model.images.begin(), model.images.end());
  WriteSparseModelBinary(model, folder / "sparse");
  Fuse(folder.path(), options);
  EXPECT_TRUE(ReadBytes(folder / "fused.ply") == cloud);
  for (auto& of_point : views) {
    for (std::uint32_t& view : of_point) view = 6 - view;
    std::reverse(of_point.begin(), of_point.end());
  }
  EXPECT_TRUE(ReadVisibility(folder / "fused.ply.vis") == views);
}

TEST(SceneFusion, WritesWhatReadersExpect) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene({}, {0, 0, -1}), folder.path());
  const SceneFusionReport report = Fuse(folder.path());
  const std::vector<Vertex> cloud = ReadCloud(folder / "fused.ply");
  ASSERT_EQ(static_cast<std::int64_t>(cloud.size()), report.num_points);
  const std::string vis = ReadBytes(folder / "fused.ply.vis");
  std::uint64_t count = 0;
  std::memcpy(&count, vis.data(), 8);
  ASSERT_EQ(count, cloud.size());
  std::size_t offset = 8;
  for (const Vertex& vertex : cloud) {
    ASSERT_NEAR(vertex.xyz[2], 4, 1e-5);
    ASSERT_NEAR(vertex.normal[2], -1, 1e-5);
    std::uint32_t n = 0;
    std::memcpy(&n, vis.data() + offset, 4);
    ASSERT_EQ(n, vertex.views);
    std::vector<std::uint32_t> views(n);
    std::memcpy(views.data(), vis.data() + offset + 4, 4 * n);
    offset += 4 + 4 * n;
    // Image k is of brightness 40 + 20 k: the colour is the mean of the images that the .vis file names.
    double brightness = 0;
    for (const std::uint32_t view : views) brightness += (40.0 + 20.0 * view) / n;
    ASSERT_NEAR(vertex.rgb[0], brightness, 0.51);
    ASSERT_EQ(vertex.inferred, 0);
  }
  EXPECT_EQ(offset, vis.size());
}

TEST(SceneFusion, LeavesOutImagesWithDamagedFilesAndNamesThem) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene({}, {0, 0, -1}), folder.path());
  for (const std::uintmax_t num_bytes : {1000, 0}) {
    fs::resize_file(MapPath(folder.path(), "normal_maps", 1), num_bytes);
    const SceneFusionReport report = Fuse(folder.path());
    EXPECT_THAT(report.failures, testing::ElementsAre(HasSubstr("normal_maps/view 1.png.geometric.bin")));
    EXPECT_EQ(report.num_images, 4);
    EXPECT_GT(report.num_points, 160 * 120);
  }
  // The photo is damaged, which comes out when its colours are read; the same bytes for any order of reading.
  test_support::WriteBytes(folder / "images" / MapWorkspaceImageName(3), "no picture");
  SceneFusionOptions options;
  options.num_threads = 1;
  const SceneFusionReport report = Fuse(folder.path(), options);
  EXPECT_THAT(report.failures, testing::ElementsAre(HasSubstr("normal_maps/view 1.png.geometric.bin"),
                                                    HasSubstr("images/view 3.png")));
  for (const int i : {0, 1}) EXPECT_EQ(report.failures[i].image, MapWorkspaceImageName(2 * i + 1));
  EXPECT_EQ(report.num_images, 3);
  EXPECT_EQ(report.outcomes[PixelOutcome::kNoDepth], 160 * 120);
  const std::string cloud = ReadBytes(folder / "fused.ply");
  options.num_threads = 4;
  EXPECT_EQ(LinesByReason(Fuse(folder.path(), options).failures), LinesByReason(report.failures));
  EXPECT_EQ(ReadBytes(folder / "fused.ply") == cloud, true);

  for (int view = 0; view < 5; ++view) fs::resize_file(MapPath(folder.path(), "depth_maps", view), 9);
  EXPECT_THAT(InputErrorOf([&] { Fuse(folder.path()); }), HasSubstr("all maps are damaged"));
}

TEST(SceneFusion, TellsOfADamagedFileWithImageAndStage) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene({}, {0, 0, -1}), folder.path());
  const fs::path photo = folder / "images" / MapWorkspaceImageName(3);
  test_support::WriteBytes(photo, "no picture");
  std::vector<phi::Message> errors;
  phi::SetLogSink([&](phi::LogLevel level, const phi::Message& message) {
    if (level == phi::LogLevel::kError) errors.push_back(message);
  });
  Fuse(folder.path());
  phi::SetLogSink({});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].image, MapWorkspaceImageName(3));
  EXPECT_EQ(errors[0].file, photo.string());
  EXPECT_EQ(errors[0].stage, "fusion");

  for (int view = 0; view < 5; ++view) fs::resize_file(MapPath(folder.path(), "depth_maps", view), 9);
  const phi::Message all = test_support::WholeMessageOf<phi::InputError>([&] { Fuse(folder.path()); });
  EXPECT_EQ(all.image, MapWorkspaceImageName(0));
  EXPECT_EQ(all.file, MapPath(folder.path(), "depth_maps", 0).string());
  EXPECT_EQ(all.stage, "fusion");
}

TEST(SceneFusion, LeavesOutImagesWithoutMaps) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene(), folder.path());
  fs::remove(MapPath(folder.path(), "depth_maps", 3));
  const LogCapture log;
  const SceneFusionReport report = Fuse(folder.path());
  EXPECT_EQ(report.num_images, 4);
  EXPECT_THAT(log.messages(), testing::Contains(HasSubstr("1 of 5 images have no geometric depth")));
  for (int view = 0; view < 5; ++view) fs::remove(MapPath(folder.path(), "depth_maps", view));
  EXPECT_THAT(InputErrorOf([&] { Fuse(folder.path()); }), HasSubstr("run patch_match_stereo first"));
}

// A map of half the size is another sampling of the same surface.
TEST(SceneFusion, MixesMapSizes) {
  const TemporaryFolder folder;
  const auto scene = PlaneScene({}, {0, 0, -1});
  WriteMapWorkspace(scene, folder.path());
  WriteDepthMap(MapPath(folder.path(), "depth_maps", 0), phi::Array2D<float>(80, 60, 4.0f));
  WriteNormalMap(MapPath(folder.path(), "normal_maps", 0), phi::Array2D<phi::Vec3f>(80, 60, {0, 0, -1}));
  const SceneFusionReport report = Fuse(folder.path());
  EXPECT_GT(report.num_points, 160 * 120);
  for (const Vertex& vertex : ReadCloud(folder / "fused.ply")) ASSERT_NEAR(vertex.xyz[2], 4, 1e-5);
  WriteDepthMap(MapPath(folder.path(), "depth_maps", 0), phi::Array2D<float>(80, 80, 4.0f));
  WriteNormalMap(MapPath(folder.path(), "normal_maps", 0), phi::Array2D<phi::Vec3f>(80, 80, {0, 0, -1}));
  EXPECT_THAT(Fuse(folder.path()).failures,
              testing::ElementsAre(HasSubstr("not the shape of its 160x120 image")));
}

// However small: rounding its sides bends the shape of a small image.
TEST(SceneFusion, ReadsMapsAtAnySmallerSize) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene({}, {0, 0, -1}), folder.path());
  for (const int size : {1, 7, 11, 50}) {
    const Workspace workspace({.path = folder.path(), .max_image_size = size});
    const FusionMapReader reader(workspace, {.mask_path = {}, .downsize = true});
    EXPECT_EQ(reader.Read(0).width(), size);
    EXPECT_EQ(reader.Read(0).height(), workspace.views()[0].camera.pinhole.height);
  }
}

// Row by row in vectors, also of maps that are read smaller.
TEST(SceneFusion, MissingAndDamagedNormalsFaceTheCamera) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene({}, {0, 0, -1}), folder.path());
  std::mt19937 random(3);
  const auto uniform = [&] { return static_cast<float>(random()) / 2147483648.0f - 1; };
  phi::Array2D<phi::Vec3f> normals(160, 120);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kLengths[] = {1, 0.9f, 0, 3, kNaN, 1e30f};
    normals.data()[i] =
        kLengths[i % std::size(kLengths)] * phi::Normalized({uniform(), uniform(), uniform()});
  }
  WriteNormalMap(MapPath(folder.path(), "normal_maps", 0), normals);
  for (const int step : {1, 2}) {
    const Workspace workspace({.path = folder.path(), .max_image_size = 160 / step});
    const FusionMapReader reader(workspace, {.mask_path = {}, .downsize = true});
    const phi::FusionMap map = reader.Read(0);
    const phi::RayModel rays = phi::MakeRayModel(reader.ReadCamera(0).pinhole);
    ASSERT_EQ(map.width(), 160 / step);
    for (int y = 0; y < map.height(); ++y) {
      for (int x = 0; x < map.width(); ++x) {
        const phi::Vec3f normal = normals(x * step + step / 2, y * step + step / 2);
        const float norm = phi::Norm(normal);
        const bool is_good = norm > 0.5f && norm < 2;
        const phi::PackedNormal expected =
            phi::PackNormal(is_good ? normal : -1.0f * rays.Ray(x + 0.5f, y + 0.5f));
        ASSERT_EQ(map(x, y).normal.x, expected.x) << x << ", " << y;
        ASSERT_EQ(map(x, y).normal.y, expected.y) << x << ", " << y;
      }
    }
  }
}

TEST(SceneFusion, MasksLeavePixelsOut) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene({}, {0, 0, -1}), folder.path());
  // All images masked where the plane's x < 0 would be seen by view 0; the others at their left halves.
  for (int view = 0; view < 5; ++view) {
    phi::GrayImage mask(160, 120, 1);  // COLMAP takes any value but 0
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 80; ++x) mask(x, y) = 0;
    }
    WriteGrayImage(folder / "masks" / (MapWorkspaceImageName(view) + ".png"), mask);
  }
  SceneFusionOptions options;
  options.input.mask_path = folder / "masks";
  const SceneFusionReport report = Fuse(folder.path(), options);
  EXPECT_GT(report.num_points, 0);
  EXPECT_EQ(report.outcomes[PixelOutcome::kNoDepth], 5 * 80 * 120);

  // A folder without masks is odd, one that is not there a mistake.
  const LogCapture log;
  options.input.mask_path = folder / "images";
  Fuse(folder.path(), options);
  EXPECT_THAT(log.messages(), testing::Contains(HasSubstr("holds no mask <image name>.png of any image")));
  options.input.mask_path = folder / "mask";
  EXPECT_THAT(InputErrorOf([&] { Fuse(folder.path(), options); }), HasSubstr("--StereoFusion.mask_path"));
}

TEST(SceneFusion, MarksInferredPixels) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene(), folder.path());
  for (int view = 0; view < 5; ++view) {
    WriteMask(folder / "stereo/filled_masks" / (MapWorkspaceImageName(view) + ".png"),
              phi::Mask(160, 120, 255));
  }
  Fuse(folder.path());
  for (const Vertex& vertex : ReadCloud(folder / "fused.ply")) {
    ASSERT_EQ(vertex.inferred, 1);
    ASSERT_GE(vertex.confidence, 1);
    ASSERT_LE(vertex.confidence, 100);
  }
}

TEST(SceneFusion, SmoothsMapsWhoseNoiseMatters) {
  const TemporaryFolder folder;
  auto scene = PlaneScene();
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for (auto& truth : scene.truth) {
    phi::PlaneMap noisy = *truth;
    for (phi::PlaneHypothesis& plane : noisy) plane.depth *= 1 + 0.003f * normal(random);
    truth = std::make_shared<phi::PlaneMap>(noisy);
  }
  WriteMapWorkspace(scene, folder.path());
  // Distances of the points from the plane (0.4, -0.2, -1) . (x - (0, 0, 4)) = 0, root mean square.
  const auto error = [&] {
    double sum = 0;
    const std::vector<Vertex> cloud = ReadCloud(folder / "fused.ply");
    for (const Vertex& v : cloud) {
      const double distance = (0.4 * v.xyz[0] - 0.2 * v.xyz[1] - (v.xyz[2] - 4.0)) / std::sqrt(1.2);
      sum += distance * distance;
    }
    return std::sqrt(sum / static_cast<double>(cloud.size()));
  };
  const SceneFusionReport report = Fuse(folder.path());
  ASSERT_EQ(report.noise_of_smoothed_maps.size(), 5u);
  for (const double noise : report.noise_of_smoothed_maps) EXPECT_NEAR(noise, 0.003, 2e-4);
  // A map's noise is 0.3 % of about 4, and a fifth of that after smoothing, before any average over images.
  EXPECT_LT(error(), 0.3 * 0.012);
  EXPECT_THAT(DescribeSmoothing(report), StartsWith("5 of 5 maps were smoothed: their depths differ from pixel to pixel by 0.30 % "));

  // The paper's rule takes maps as they are, and so does a tolerance that the noise hardly touches.
  SceneFusionOptions options;
  options.rule.method.formulas = phi::Formulas::kPaper;
  EXPECT_TRUE(Fuse(folder.path(), options).noise_of_smoothed_maps.empty());
  options.rule = {.max_depth_error = 0.04};
  EXPECT_TRUE(Fuse(folder.path(), options).noise_of_smoothed_maps.empty());
  EXPECT_EQ(DescribeSmoothing(Fuse(folder.path(), options)), "");
  options.rule = {};
  options.rule.method.rules.Set(phi::Rule::kMapNoise, 0);
  EXPECT_TRUE(Fuse(folder.path(), options).noise_of_smoothed_maps.empty());
}

TEST(SceneFusion, OneImageExplainsItself) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene({.num_views = 1}), folder.path());
  const SceneFusionReport report = Fuse(folder.path());
  EXPECT_EQ(report.num_points, 0);
  EXPECT_EQ(ReadCloud(folder / "fused.ply").size(), 0u);
  EXPECT_THAT(ExplainFewPoints(report), HasSubstr("only one image"));
  SceneFusionOptions options;
  options.rule.min_num_views = 1;
  EXPECT_EQ(Fuse(folder.path(), options).num_points, 160 * 120);
}

TEST(SceneFusion, NoConsistentPixelHasAHistogram) {
  const TemporaryFolder folder;
  auto scene = PlaneScene({}, {0, 0, -1});
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    scene.truth[i] =
        std::make_shared<phi::PlaneMap>(Scaled(*scene.truth[i], 1 + 0.1 * static_cast<double>(i)));
  }
  WriteMapWorkspace(scene, folder.path());
  const SceneFusionReport report = Fuse(folder.path());
  EXPECT_EQ(report.num_points, 0);
  EXPECT_THAT(ExplainFewPoints(report), HasSubstr("depth maps contradict each other"));
  EXPECT_THAT(OutcomeHistogram(report.outcomes), HasSubstr("%  depth differs between images"));

  // Empty maps have another cause.
  for (int view = 0; view < 5; ++view) {
    WriteDepthMap(MapPath(folder.path(), "depth_maps", view), phi::Array2D<float>(160, 120, 0.0f));
  }
  EXPECT_THAT(ExplainFewPoints(Fuse(folder.path())), AllOf(HasSubstr("maps are almost empty"), HasSubstr("masks")));
}

TEST(SceneFusion, FarWorldsHaveAnOffset) {
  const TemporaryFolder folder;
  auto scene = PlaneScene({}, {0, 0, -1});
  EXPECT_EQ(
      ChooseCoordinates((WriteMapWorkspace(scene, folder / "near"), Workspace({.path = folder / "near"}))).offset,
      (std::array<double, 3>{0, 0, 0}));
  Similarity shift;
  shift.translation = {400000, 5000000, 300};
  Transform(shift, &scene);
  WriteMapWorkspace(scene, folder.path());
  const auto offset = ChooseCoordinates(Workspace({.path = folder.path()})).offset;
  EXPECT_NEAR(offset[1], 5000000, 1);
  Fuse(folder.path(), {}, "fused.ply", {.path = {}, .offset = offset});
  EXPECT_THAT(ReadBytes(folder / "fused.ply").substr(0, 200),
              HasSubstr("\ncomment offset 400000 5000000 300\n"));
  for (const Vertex& vertex : ReadCloud(folder / "fused.ply")) ASSERT_NEAR(vertex.xyz[2], 4, 1e-4);
}

TEST(SceneFusion, NumbersFilesBeyondTheMostPoints) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene(), folder.path());
  const std::int64_t total = Fuse(folder.path()).num_points;
  Fuse(folder.path(), {}, "parts.ply", {.path = {}, .max_points_per_file = 10000});
  const auto first = ReadCloud(folder / "parts.ply"), second = ReadCloud(folder / "parts_2.ply");
  EXPECT_EQ(first.size(), 10000u);
  EXPECT_EQ(second.size(), static_cast<std::size_t>(std::min<std::int64_t>(total - 10000, 10000)));
  EXPECT_TRUE(fs::exists(folder / "parts_2.ply.vis"));
  // Each point's views go with it, after a count of eight bytes.
  const auto views_of = [&](const char* name) { return ReadBytes(folder / name).substr(8); };
  const std::string both = views_of("parts.ply.vis") + views_of("parts_2.ply.vis");
  EXPECT_TRUE(views_of("fused.ply.vis").starts_with(both));
  const std::string views = views_of("parts.ply.vis");
  std::size_t end = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    ASSERT_LT(end, views.size());
    std::uint32_t count;
    std::memcpy(&count, views.data() + end, sizeof(count));
    end += (1 + count) * sizeof(count);
  }
  EXPECT_EQ(end, views.size());
}

// What readers that count in 32 bits with a sign can hold.
TEST(SceneFusion, AFileHoldsAtMost2To31Points) { EXPECT_EQ(PlyCloudOptions().max_points_per_file, (std::uint64_t{1} << 31) - 1); }

// What a larger cloud left would be taken for a part of the smaller one.
TEST(SceneFusion, ASmallerCloudLeavesNoNumberedFileOfALargerOne) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene(), folder.path());
  const auto exist = [&](std::vector<const char*> names) {
    for (const char* name : names) {
      if (!fs::exists(folder / name)) return false;
    }
    return true;
  };
  Fuse(folder.path(), {}, "c.ply", {.path = {}, .max_points_per_file = 6000});
  ASSERT_TRUE(exist({"c_2.ply", "c_3.ply", "c_4.ply", "c_4.ply.vis"}));
  Fuse(folder.path(), {}, "c.ply", {.path = {}, .max_points_per_file = 12000});
  EXPECT_TRUE(exist({"c.ply", "c.ply.vis", "c_2.ply", "c_2.ply.vis"}));
  for (const char* name : {"c_3.ply", "c_3.ply.vis", "c_4.ply", "c_4.ply.vis"}) EXPECT_FALSE(exist({name})) << name;
  Fuse(folder.path(), {}, "c.ply");
  for (const char* name : {"c_2.ply", "c_2.ply.vis"}) EXPECT_FALSE(exist({name})) << name;

  Fuse(folder.path(), {}, "c.ply", {.path = {}, .max_points_per_file = 6000});
  RemoveEarlierCloud(folder / "c.ply");
  for (const char* name : {"c.ply", "c.ply.vis", "c_2.ply", "c_4.ply.vis"}) EXPECT_FALSE(exist({name})) << name;

  // Clouds of their own, whoever named them so.
  Fuse(folder.path(), {}, "c_2.ply");
  test_support::WriteBytes(folder / "d_2.ply", "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n");
  Fuse(folder.path(), {}, "other.ply", {.path = {}, .max_points_per_file = 15000});
  fs::rename(folder / "other_2.ply", folder / "e_2.ply");
  Fuse(folder.path(), {}, "c.ply");
  Fuse(folder.path(), {}, "d.ply");
  Fuse(folder.path(), {}, "e.ply");
  EXPECT_TRUE(exist({"c_2.ply", "c_2.ply.vis", "d_2.ply", "e_2.ply"}));
}

TEST(SceneFusion, WritesSparseModels) {
  const TemporaryFolder folder;
  WriteMapWorkspace(PlaneScene({}, {0, 0, -1}), folder.path());
  const Workspace workspace({.path = folder.path()});
  for (const SparseFormat format : {SparseFormat::kBinary, SparseFormat::kText}) {
    const fs::path out = folder / (format == SparseFormat::kBinary ? "bin" : "txt");
    const auto writer = MakeSparseCloudWriter(workspace.model(), out, format);
    SceneFusionOptions options;
    options.scratch_folder = out;
    const SceneFusionReport report = FuseScene(workspace, options, writer.get());
    writer->Commit();
    const SparseModel model = ReadSparseModel(out);
    EXPECT_EQ(static_cast<std::int64_t>(model.points.size()), report.num_points);
    EXPECT_NEAR(model.points[100].xyz.z(), 4, 1e-6);
    EXPECT_EQ(model.images.size(), 5u);
  }
}

TEST(BoundingBoxFile, IsSixNumbers) {
  const TemporaryFolder folder;
  test_support::WriteBytes(folder / "box.txt", "-1 -2 -3\n4 5 6\n");
  const phi::BoundingBox box = ReadBoundingBox(folder / "box.txt");
  EXPECT_EQ(box.min[2], -3);
  EXPECT_EQ(box.max[0], 4);
  test_support::WriteBytes(folder / "box.txt", "-1 -2 -3\n4 5\n");
  EXPECT_THAT(InputErrorOf([&] { ReadBoundingBox(folder / "box.txt"); }), HasSubstr("six numbers"));
  for (const char* other : {"-1,5 -2 -3\n4 5 6\n", "-1 -2 -3\n4 5 6\n7 8 9\n"}) {
    test_support::WriteBytes(folder / "box.txt", other);
    EXPECT_THAT(InputErrorOf([&] { ReadBoundingBox(folder / "box.txt"); }), HasSubstr("six numbers with decimal points and no more"));
  }
  test_support::WriteBytes(folder / "box.txt", "\xEF\xBB\xBF-1 -2 -3\r\n4 5 6\r\n");  // as Windows' editor saves it
  EXPECT_EQ(ReadBoundingBox(folder / "box.txt").min[0], -1);
  test_support::WriteBytes(folder / "box.txt", "-1 7 -3\n4 5 6\n");
  EXPECT_THAT(InputErrorOf([&] { ReadBoundingBox(folder / "box.txt"); }), HasSubstr("smaller"));
}

}  // namespace
}  // namespace colmap_ext

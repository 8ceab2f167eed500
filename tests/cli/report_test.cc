#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/report/report.h"
#include "colmap_ext/report/report_cloud.h"
#include "colmap_ext/report/report_pictures.h"
#include "colmap_ext/sparse_model.h"
#include "colmap_ext/workspace.h"
#include "tests/support/browser.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using testing::HasSubstr;
using testing::Not;

constexpr int kWidth = 64, kHeight = 48;

// Red photos, each with a depth map that is valid in its left three quarters, of which the last was filled.
void WriteWorkspace(const std::filesystem::path& dense, const std::vector<std::string>& names) {
  colmap_ext::SparseModel model;
  model.cameras[1] = {1, 1, kWidth, kHeight, {60, 60, kWidth / 2.0, kHeight / 2.0}};
  for (const std::string& name : names) {
    colmap_ext::SparseImage image;
    image.image_id = static_cast<std::uint32_t>(model.images.size() + 1);
    image.camera_id = 1;
    image.name = name;
    model.images.push_back(image);
  }
  std::filesystem::create_directories(dense / "sparse");
  colmap_ext::WriteSparseModelBinary(model, dense / "sparse");
  std::filesystem::create_directories(dense / "images");
  std::filesystem::create_directories(dense / "stereo/filled_masks");

  phi::Array2D<float> raw(kWidth, kHeight, 2.0f), measured(kWidth, kHeight), geometric(kWidth, kHeight);
  cv::Mat filled(kHeight, kWidth, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 48; ++x) {
      geometric(x, y) = 2;
      if (x < 32) measured(x, y) = 2;
      if (x >= 32) filled.at<std::uint8_t>(y, x) = 255;
    }
  }
  const auto maps = dense / "stereo" / "depth_maps";
  for (const std::string& name : names) {
    cv::imwrite((dense / "images" / name).string(), cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(0, 0, 255)));
    colmap_ext::WriteDepthMap(maps / (name + ".photometric.bin"), raw);
    colmap_ext::WriteDepthMap(maps / (name + ".measured.bin"), measured);
    colmap_ext::WriteDepthMap(maps / (name + ".geometric.bin"), geometric);
    cv::imwrite((dense / "stereo/filled_masks" / (name + ".png")).string(), filled);
  }
  WriteBytes(dense / "stereo/phimvs.json",
             R"({"version": "1.2.3", "options": {"PhiStereo.quality": "fast", "tile_size": "50",
             "crs": "", "output_path": "elsewhere.ply"}, "options_hash": "h",
             "runs": [{"finished": "2025-01-02T03:04:05Z", "seconds": 3.5, "images": 1, "images_kept": 0, "images_made": 1, "images_failed": 0,
              "images_per_second": 0.286, "stages": [{"stage": "photometric", "images": 1, "seconds": 2.25}],
              "devices": [{"name": "cuda:0 Card", "peak_memory_bytes": 1250000000,
                           "stages": [{"stage": "estimation", "images": 1, "seconds": 2, "samples_per_second": 9.1e11}]}],
              "peak_memory_bytes": 2340000000, "peak_cache_bytes": 1, "bytes_written": 400000000,
              "bytes_per_second_and_writer": 120000000}], "images": {"a.png":
             {"photometric": {"state": "done", "key": "k", "seconds": 2.5, "peak_memory_bytes": 5000000,
              "warnings": ["</script> sees <one> view"]}}}})");
  WriteBytes(dense / "fused.ply",
             "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
             "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 2 9 8 7\n1 1 2 "
             "255 0 0\n");
  WriteBytes(
      dense / "ours.json",
      R"({"tolerances": [0.01, 0.02], "accuracy": [50, 60], "completeness": [70, 80], "f1": [58.3, 68.6]})");
}

class ReportCommand : public testing::Test {
 protected:
  ReportCommand() { WriteWorkspace(folder_ / "dense", {"a.png"}); }

  ProgramResult Write(const std::vector<std::string>& more = {}) {
    std::vector<std::string> command{PHIMVS_BINARY, "report", "--workspace_path", folder_ / "dense", "--output_path",
                                     folder_ / "report.html", "--evaluation_path", folder_ / "dense/ours.json"};
    command.insert(command.end(), more.begin(), more.end());
    return RunProgram(command);
  }

  // The data that the page draws from.
  nlohmann::json Data(const std::string& name = "report.html") {
    const std::string page = ReadBytes(folder_ / name),
                      mark = "<script id=\"data\" type=\"application/json\">";
    const std::size_t begin = page.find(mark) + mark.size();
    return nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
  }

  TemporaryFolder folder_;
};

TEST_F(ReportCommand, TellsCoverageTimesSettingsAndScores) {
  const ProgramResult result = Write();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json data = Data();
  const auto& image = data["images"][0];
  EXPECT_EQ(image["photometric"], 100.0);
  EXPECT_EQ(image["measured"], 50.0);
  EXPECT_EQ(image["geometric"], 75.0);
  EXPECT_EQ(image["filled"], 25.0);
  EXPECT_EQ(data["stages"]["photometric"]["seconds"], 2.5);
  EXPECT_EQ(data["stages"]["photometric"]["peak_memory_bytes"], 5000000);
  EXPECT_EQ(data["runs"][0]["stages"][0]["seconds"], 2.25);
  EXPECT_EQ(data["options"]["PhiStereo.quality"], "fast");
  EXPECT_EQ(data["warnings"][0], "a.png (photometric): </script> sees <one> view");
  EXPECT_EQ(data["evaluations"][0]["name"], "ours");
  EXPECT_EQ(data["cloud"]["num_points"], 2);
  EXPECT_EQ(data["chosen_options"], nlohmann::json({{"PhiStereo.quality", "fast"}, {"tile_size", "50"}}))
      << "defaults and places of files are nobody's choice";
  // 48 of 64 columns have depth 2, which lies in the eighths of an octave from 8 log2(2) = 8; f = 60 pixels.
  EXPECT_EQ(image["depth_histogram"], nlohmann::json::array({{8, 48 * kHeight}}));
  EXPECT_NEAR(image["pixel_size"], 2 / 60.0, 1e-6);
}

TEST_F(ReportCommand, ShowsConfidencesWhereThereAreSome) {
  const auto titles = [&] {
    EXPECT_EQ(Write().exit_code, 0);
    std::string all;
    const nlohmann::json data = Data();
    for (const auto& picture : data["images"][0]["pictures"]) all += picture["title"].get<std::string>() + "\n";
    return all;
  };
  EXPECT_THAT(titles(), Not(HasSubstr("Confidence")));
  colmap_ext::WriteDepthMap(folder_ / "dense/stereo/confidence_maps/a.png.geometric.bin", phi::Array2D<float>(kWidth, kHeight, 0.5f));
  EXPECT_THAT(titles(), HasSubstr("Confidence"));
}

TEST_F(ReportCommand, NeedsNoNetwork) {
  ASSERT_EQ(Write().exit_code, 0);
  const std::string page = ReadBytes(folder_ / "report.html");
  EXPECT_THAT(page, Not(HasSubstr("src=\"http")));
  EXPECT_THAT(page, Not(HasSubstr("href=\"http")));
  EXPECT_THAT(page, Not(HasSubstr("@import")));
  EXPECT_THAT(page, Not(HasSubstr("/*PAGE*/")));
}

TEST_F(ReportCommand, DamagedFilesAreWarningsNotAnEnd) {
  WriteBytes(folder_ / "dense/stereo/depth_maps/a.png.measured.bin", "64&48&1&short");
  WriteBytes(folder_ / "dense/images/a.png", "no picture");
  WriteBytes(folder_ / "dense/stereo/phimvs.json", R"({"images": {"a.png": {"measured": 5}}})");
  const ProgramResult result = Write();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (const char* file : {"a.png.measured.bin", "images/a.png", "stereo/phimvs.json is damaged"}) {
    EXPECT_THAT(Data()["warnings"].dump(), HasSubstr(file));
  }
}

// Of 10,000 images a missing photo would be 30 warnings, and a thousand of them a page that no browser opens.
TEST_F(ReportCommand, WarningsOfOneReasonAreOneLine) {
  nlohmann::json record = nlohmann::json::parse(ReadBytes(folder_ / "dense/stereo/phimvs.json"));
  for (int i = 0; i < 100; ++i) {
    record["images"]["b" + std::to_string(100 + i)]["photometric"] = {
        {"state", "done"}, {"key", "k"}, {"warnings", {"source image left out: /w/7.png: is missing"}}};
  }
  WriteBytes(folder_ / "dense/stereo/phimvs.json", record.dump());
  ASSERT_EQ(Write().exit_code, 0);
  const nlohmann::json warnings = Data()["warnings"];
  ASSERT_EQ(warnings.size(), 2u) << warnings;
  EXPECT_EQ(warnings[0], "b100, b101, b102, b103, b104 and 95 more (photometric): source image left out: /w/7.png: is missing");
}

TEST_F(ReportCommand, SaysThatThereIsNothingToReport) {
  std::filesystem::remove_all(folder_ / "dense/stereo/depth_maps");
  EXPECT_EQ(Write().exit_code, 0) << "the cloud is there still";
  std::filesystem::remove(folder_ / "report.html");
  std::filesystem::remove(folder_ / "dense/fused.ply");
  const ProgramResult result = Write();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("run phimvs patch_match_stereo first"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "report.html"));
}

TEST_F(ReportCommand, RefusesToCompareWithWhatIsNoWorkspace) {
  const ProgramResult result = Write({"--compare_workspace_path", folder_ / "nowhere"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("--compare_workspace_path: " + (folder_ / "nowhere").string()));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "report.html"));
}

TEST_F(ReportCommand, RefusesTruthOfNoImage) {
  colmap_ext::WriteDepthMap(folder_ / "truth/b.png.bin", phi::Array2D<float>(kWidth, kHeight, 2.0f));
  for (const bool has_cloud : {true, false}) {
    if (!has_cloud) std::filesystem::remove(folder_ / "dense/fused.ply");
    const ProgramResult result = Write({"--truth_depth_maps", folder_ / "truth"});
    EXPECT_EQ(result.exit_code, 2) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr((folder_ / "truth").string() + ": no true depth map here has the name of an image of"));
    EXPECT_THAT(result.errors, HasSubstr("such as a.png.png"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "report.html"));
  }
}

// With the cloud and without: the points are compared, and the pictures.
TEST_F(ReportCommand, RefusesTruthOfAnotherShape) {
  const auto truth = folder_ / "truth/a.png.bin";
  for (const bool has_cloud : {true, false}) {
    if (!has_cloud) std::filesystem::remove(folder_ / "dense/fused.ply");
    colmap_ext::WriteDepthMap(truth, phi::Array2D<float>(kWidth, kWidth, 2.0f));
    const ProgramResult result = Write({"--truth_depth_maps", folder_ / "truth"});
    EXPECT_EQ(result.exit_code, 2) << result.errors;
    EXPECT_THAT(result.errors,
                HasSubstr(truth.string() + ", the truth of a.png: this map is 64x64, which is not the shape of its 64x48 image"));
    colmap_ext::WriteDepthMap(truth, phi::Array2D<float>(kWidth / 2, kHeight / 2, 2.0f));
    EXPECT_EQ(Write({"--truth_depth_maps", folder_ / "truth"}).exit_code, 0);
  }
}

TEST_F(ReportCommand, RefusesScoresOfAnotherKind) {
  WriteBytes(folder_ / "dense/ours.json", "{}");
  const ProgramResult result = Write();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("ours.json"));
}

// A real browser draws the page at a desktop's and at a phone's width.
TEST_F(ReportCommand, BrowserDrawsIt) {
  const std::string browser = test_support::FindBrowser();
  if (browser.empty()) GTEST_SKIP() << "no chromium on PATH";
  ASSERT_EQ(Write().exit_code, 0);
  for (const char* size : {"1280,4200", "500,9000"}) {
    const test_support::BrowserResult result = test_support::RunBrowser(
        browser, folder_ / "report.html",
        {"--virtual-time-budget=8000", std::string("--window-size=") + size, "--screenshot=" + (folder_ / "page.png").string()});
    if (!result) GTEST_SKIP() << "the browser drew nothing within five minutes";
    const cv::Mat page = cv::imread((folder_ / "page.png").string());
    ASSERT_FALSE(page.empty()) << result->errors;
    // The photo is the only large red area; coverage bars are blue and orange.
    const auto share = [&](const cv::Scalar& lower, const cv::Scalar& upper) {
      cv::Mat inside;
      cv::inRange(page, lower, upper, inside);
      return static_cast<double>(cv::countNonZero(inside)) / static_cast<double>(page.total());
    };
    EXPECT_GT(share({0, 0, 240}, {15, 15, 255}), 0.005) << "the photo at " << size;
    EXPECT_GT(share({180, 115, 40}, {186, 125, 44}), 0.0005) << "the measured bar at " << size;
    if (page.cols > 1000) {  // a narrow page has the bar's column beyond its right side
      EXPECT_GT(share({59, 161, 230}, {63, 165, 234}), 0.00005) << "the filled bar at " << size;
    }
    std::filesystem::remove(folder_ / "page.png");
  }
}

template <typename T>
void AppendBytes(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// A cloud of points 0, 1, 2, ... along x, with the images that see them: i % 3 of them, 10 (i % 1000) and the next.
void WriteCloud(const std::filesystem::path& path, std::uint32_t num_points) {
  std::string cloud = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(num_points) +
                      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar inferred\nproperty uchar confidence\nend_header\n";
  std::string visibility;
  AppendBytes(std::uint64_t{num_points}, &visibility);
  for (std::uint32_t i = 0; i < num_points; ++i) {
    for (const float coordinate : {static_cast<float>(i), 0.0f, 0.0f}) AppendBytes(coordinate, &cloud);
    AppendBytes(static_cast<std::uint8_t>(i % 2), &cloud);
    AppendBytes(static_cast<std::uint8_t>(i % 101), &cloud);
    AppendBytes(i % 3, &visibility);
    for (std::uint32_t view = 0; view < i % 3; ++view) AppendBytes(10 * (i % 1000) + view, &visibility);
  }
  WriteBytes(path, cloud);
  WriteBytes(path.string() + ".vis", visibility);
}

std::vector<std::uint16_t> ViewsOf(int point) {
  std::vector<std::uint16_t> views;
  for (int view = 0; view < point % 3; ++view) views.push_back(static_cast<std::uint16_t>(10 * (point % 1000) + view));
  return views;
}

// Neither half of the budget is lost where it is a little more than half of the points, nor is every second one taken.
TEST(SampleCloud, TakesWhatIsAskedForAtRandomWithItsViews) {
  const TemporaryFolder folder;
  WriteCloud(folder / "a.ply", 1000);
  for (const int wanted : {300, 600}) {
    const colmap_ext::CloudSample sample = colmap_ext::SampleCloud(folder / "a.ply", wanted);
    EXPECT_EQ(sample.num_points, 1000u);
    ASSERT_EQ(sample.points.size(), static_cast<std::size_t>(wanted));
    int num_first_half = 0, num_odd = 0, last = -1;
    for (const auto& point : sample.points) {
      const int i = static_cast<int>(point.xyz[0]);
      EXPECT_GT(i, last) << "in the file's order, none twice";
      last = i;
      num_first_half += i < 500;
      num_odd += i % 2;
      EXPECT_EQ(point.inferred, i % 2 == 1);
      EXPECT_EQ(point.confidence, i % 101);
      EXPECT_EQ(point.views, ViewsOf(i)) << i;
    }
    EXPECT_NEAR(num_first_half, wanted / 2, 40);  // standard deviation: 8
    EXPECT_NEAR(num_odd, wanted / 2, 40);
  }
  EXPECT_EQ(colmap_ext::SampleCloud(folder / "a.ply", 5000).points.size(), 1000u);
}

// 400,000 points and 800,000 words of views are read in several parts, and most of them passed over.
TEST(SampleCloud, FindsAFewPointsOfManyWithTheirViews) {
  const TemporaryFolder folder;
  WriteCloud(folder / "a.ply", 400000);
  const colmap_ext::CloudSample sample = colmap_ext::SampleCloud(folder / "a.ply", 50);
  ASSERT_EQ(sample.points.size(), 50u);
  for (const auto& point : sample.points) {
    const int i = static_cast<int>(point.xyz[0]);
    EXPECT_EQ(point.inferred, i % 2 == 1);
    EXPECT_EQ(point.views, ViewsOf(i)) << i;
  }
  EXPECT_GT(sample.points.back().xyz[0], 300000);
}

// Another program's. The cube around the points was none, and the page showed no point.
TEST(SampleCloud, PointsThatAreNowhereAreLeftOut) {
  const TemporaryFolder folder;
  WriteCloud(folder / "a.ply", 100);
  std::string bytes = ReadBytes(folder / "a.ply");
  for (const int i : {3, 50, 99}) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::memcpy(bytes.data() + bytes.find("end_header\n") + 11 + 14 * i, &nan, sizeof(nan));
  }
  WriteBytes(folder / "a.ply", bytes);
  const colmap_ext::CloudSample sample = colmap_ext::SampleCloud(folder / "a.ply", 100);
  ASSERT_EQ(sample.points.size(), 97u);
  EXPECT_EQ(sample.points[3].xyz[0], 4);
  EXPECT_EQ(sample.points[3].views, ViewsOf(4));
  EXPECT_GT(colmap_ext::PackCloud(sample).num_shown, 90u);
}

// The points before the place where the file ends keep their views.
TEST(SampleCloud, ViewsOfAShortFileEndWithIt) {
  const TemporaryFolder folder;
  WriteCloud(folder / "a.ply", 6);
  const std::string whole = ReadBytes(folder / "a.ply.vis");
  WriteBytes(folder / "a.ply.vis", whole.substr(0, whole.size() - sizeof(std::uint32_t)));
  const colmap_ext::CloudSample sample = colmap_ext::SampleCloud(folder / "a.ply", 6);
  EXPECT_EQ(sample.points[4].views, ViewsOf(4));
  EXPECT_EQ(sample.points[5].views.size(), 1u) << "of two";
}

// Images and cloud are made side by side; the page tells when it was written, and nothing else of that.
TEST_F(ReportCommand, IsTheSameForAnyNumberOfThreads) {
  const auto dense = folder_ / "many";
  WriteWorkspace(dense, {"a.png", "b.png", "c.png", "d.png", "e.png"});
  WriteBytes(dense / "stereo/depth_maps/c.png.measured.bin", "64&48&1&short");
  WriteCloud(dense / "fused.ply", 20000);
  colmap_ext::ReportOptions options;
  options.workspace = dense;
  options.max_points = 5000;
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    options.output = folder_ / (std::to_string(threads) + ".html");
    colmap_ext::WriteReport(options);
  }
  nlohmann::json one = Data("1.html");
  EXPECT_EQ(one["images"].size(), 5u);
  one.erase("written");
  for (const char* name : {"2.html", "5.html"}) {
    nlohmann::json other = Data(name);
    other.erase("written");
    EXPECT_EQ(one, other) << name;
  }
}

// Of 512 rows those of odd number have depth; they are the 256 that are read where there are no pictures.
TEST_F(ReportCommand, FiguresOfLargeMapsWithoutPicturesAreOfSomeRows) {
  constexpr int kRows = 512;
  WriteWorkspace(folder_ / "dense", {"a.png", "b.png"});
  phi::Array2D<float> depth(kWidth, kRows);
  cv::Mat filled(kRows, kWidth, CV_8UC1, cv::Scalar(0));
  for (int y = 1; y < kRows; y += 2) {
    for (int x = 0; x < kWidth; ++x) depth(x, y) = 2;
    filled.row(y).colRange(0, kWidth / 4) = 255;
  }
  phi::MeasurementMap raw{phi::PlaneMap(kWidth, kRows), {}};
  for (std::size_t i = 0; i < raw.size(); ++i) raw.planes.data()[i] = {{0, 0, -1}, depth.data()[i]};
  const colmap_ext::Workspace workspace({.path = folder_ / "dense"});
  for (const int image : {0, 1}) {
    for (const char* kind : {"measured", "geometric"}) colmap_ext::WriteDepthMap(workspace.DepthMapPath(image, kind), depth);
    colmap_ext::PrepareCompactMap(colmap_ext::CompactMapPath(workspace, image, "photometric"), raw)->Commit();
    cv::imwrite(workspace.FilledMaskPath(image).string(), filled);
  }
  ASSERT_EQ(Write({"--max_images", "1"}).exit_code, 0);
  const auto images = Data()["images"];
  for (const int i : {0, 1}) {
    const auto& image = images[static_cast<std::size_t>(i)];
    const double share = i == 0 ? 50 : 100;
    for (const char* kind : {"photometric", "measured", "geometric"}) EXPECT_EQ(image[kind], share) << i << kind;
    EXPECT_EQ(image["filled"], share / 4) << i;
    EXPECT_EQ(image["height"], kRows);
    const int num_pixels = kWidth * kRows * static_cast<int>(share) / 100;
    EXPECT_EQ(image["depth_histogram"], nlohmann::json::array({{8, num_pixels}})) << "pixels of the map, not of its rows";
  }
}

// The files after the first one name it; another cloud's name alone makes none of them.
TEST_F(ReportCommand, CountsThePointsOfAllFilesOfACloud) {
  const auto cloud = folder_ / "dense/fused.ply";
  const auto count = [&] {
    EXPECT_EQ(Write().exit_code, 0);
    const auto data = Data()["cloud"];
    return std::pair<int, int>{data["num_points"], data["num_files"]};
  };
  WriteCloud(cloud, 7);
  WriteCloud(folder_ / "dense/fused_2.ply", 50);
  EXPECT_EQ(count(), std::pair(7, 1));
  const auto writer = colmap_ext::MakePlyCloudWriter({.path = cloud, .max_points_per_file = 2});
  phi::FusedBlock block;
  block.points.resize(5);
  block.view_counts.resize(5);
  writer->Write(block);
  writer->Commit();
  ASSERT_TRUE(std::filesystem::exists(folder_ / "dense/fused_3.ply"));
  EXPECT_EQ(count(), std::pair(5, 3));
  EXPECT_EQ(Data()["cloud"]["num_shown"], 2);
}

// One camera at the origin, f = 60, the truth at depth 2 everywhere: a point at 2.02 is 1 % off, one beside the image is
// not known.
TEST_F(ReportCommand, ErrorsAreThoseInDepth) {
  phi::Array2D<float> truth(kWidth, kHeight, 2.0f);
  colmap_ext::WriteDepthMap(folder_ / "truth/a.png.bin", truth);
  WriteBytes(folder_ / "dense/fused.ply",
             "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
             "end_header\n0.1 0.1 2.02\n3 0 2\n");
  std::string visibility;
  const auto add = [&](auto value) { visibility.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  add(std::uint64_t{2});
  for (int i = 0; i < 2; ++i) {
    add(std::uint32_t{1});
    add(std::uint32_t{0});
  }
  WriteBytes(folder_ / "dense/fused.ply.vis", visibility);
  colmap_ext::CloudSample sample = colmap_ext::SampleCloud(folder_ / "dense/fused.ply", 10);
  const colmap_ext::Workspace workspace({.path = folder_ / "dense"});
  colmap_ext::CompareWithTruth(workspace, {{"a.png", folder_ / "truth/a.png.bin"}}, 1000, &sample);
  EXPECT_NEAR(sample.points[0].error * colmap_ext::CloudSample::kErrorUnit, 0.01, 0.0003);
  EXPECT_EQ(sample.points[1].error, 255);
}

// The same point and the same truth, the cloud written from an offset; so are the cameras of the page.
TEST_F(ReportCommand, ACloudWithAnOffsetIsComparedInTheWorld) {
  colmap_ext::WriteDepthMap(folder_ / "truth/a.png.bin", phi::Array2D<float>(kWidth, kHeight, 2.0f));
  WriteBytes(folder_ / "dense/fused.ply",
             "ply\nformat ascii 1.0\ncomment offset 100 -200 300\nelement vertex 1\nproperty float x\nproperty float y\n"
             "property float z\nproperty uchar inferred\nend_header\n-99.9 200.1 -297.98 0\n");
  std::string visibility;
  AppendBytes(std::uint64_t{1}, &visibility);
  for (const std::uint32_t word : {1u, 0u}) AppendBytes(word, &visibility);
  WriteBytes(folder_ / "dense/fused.ply.vis", visibility);
  colmap_ext::ReportOptions options;
  options.workspace = folder_ / "dense";
  options.truth_depth_maps = folder_ / "truth";
  options.output = folder_ / "r.html";
  colmap_ext::WriteReport(options);
  const auto cloud = Data("r.html")["cloud"];
  // 1 % in steps of 5 % / 254, rounded down: 50.8, and single precision.
  EXPECT_EQ(cloud["errors"], colmap_ext::Base64(std::string(1, '\x32')));
  EXPECT_EQ(cloud["cameras"][0]["center"], (std::vector<double>{-100, 200, -300}));
}

TEST(Base64, PadsAsTheStandardDoes) {
  EXPECT_EQ(colmap_ext::Base64("Man"), "TWFu");
  EXPECT_EQ(colmap_ext::Base64("Ma"), "TWE=");
  EXPECT_EQ(colmap_ext::Base64("M"), "TQ==");
}

}  // namespace

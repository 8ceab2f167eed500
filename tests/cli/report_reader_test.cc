#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/report/report_cloud.h"
#include "tests/support/browser.h"
#include "tests/support/run_on_workspace.h"
#include "tests/support/temporary_folder.h"

namespace {

using nlohmann::json;
using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using testing::HasSubstr;

constexpr int kMaxPoints = 60;  // so few that some lie alone on the screen

using Names = std::vector<std::string>;

std::string Between(const std::string& text, const std::string& begin, const std::string& end) {
  const std::size_t from = text.rfind(begin);
  if (from == std::string::npos) return "";
  return text.substr(from + begin.size(), text.find(end, from) - from - begin.size());
}

// Maps that are smaller than the photos, one of which is missing; truth and scores.
void WriteRoomReport(const std::filesystem::path& folder) {
  test_support::MakeRoom(folder, 96, 72, 5);
  const std::string dense = folder / "room/dense", cloud = dense + "/fused.ply", scores = folder / "scores.json";
  const auto run = [](const std::vector<std::string>& words) {
    const ProgramResult result = RunProgram(words);
    ASSERT_EQ(result.exit_code, 0) << words[1] << ": " << result.errors;
  };
  run({PHIMVS_BINARY, "dense", "--workspace_path", dense, "--PhiStereo.backend", "cpu", "--PhiStereo.quality", "fast",
       "--StereoFusion.min_num_pixels", "2", "--PatchMatchStereo.max_image_size", "80"});
  run({PHIMVS_BINARY, "evaluate", "--cloud_path", cloud, "--truth_path", cloud, "--tolerances", "0.01,0.02", "--output_path",
       scores});
  std::filesystem::remove(dense + "/images/room0003.png");
  run({PHIMVS_BINARY, "report", "--workspace_path", dense, "--max_points", std::to_string(kMaxPoints), "--truth_depth_maps",
       folder / "room/truth/depth_maps", "--evaluation_path", scores, "--output_path", folder / "report.html"});
}

// What report_reader.js did and saw.
json ReadAsAReader(const std::filesystem::path& folder, const std::string& browser) {
  std::string page = ReadBytes(folder / "report.html");
  const std::string reader = ReadBytes(PHIMVS_SOURCE_DIR "/tests/cli/report_reader.js");
  page.insert(page.find("<style>"), "<script>\n" + reader + "</script>\n");  // before the page's own, to hear of their errors
  test_support::WriteBytes(folder / "read.html", page);
  const test_support::BrowserResult result = test_support::RunBrowser(
      browser, folder / "read.html", {"--window-size=1280,900", "--virtual-time-budget=60000", "--dump-dom"});
  if (!result) return {};
  const std::string notes = Between(result->output, "<pre id=\"notes\">", "</pre>");
  EXPECT_FALSE(notes.empty()) << "the browser ended with " << result->exit_code << ": " << result->errors;
  return json::parse(notes.empty() ? "{}" : notes);
}

void ExpectCloudChanges(const json& notes) {
  std::set<std::string> pictures;
  Names modes;
  for (const json& mode : notes["colors"]) {
    modes.push_back(mode[0]);
    pictures.insert(mode[1]);
  }
  EXPECT_EQ(modes, (Names{"Photo colours", "Measured or inferred", "Confidence", "Normals", "Number of images", "Error to truth"}));
  EXPECT_EQ(pictures.size(), modes.size()) << "each colours the cloud in its own way: " << notes["colors"];
  EXPECT_EQ(notes["colors"][0][1], notes["start"]);
  for (std::size_t i = 1; i < notes["views"].size(); ++i) {
    EXPECT_NE(notes["views"][i][1], notes["views"][i - 1][1]) << notes["views"][i][0] << " changes the view";
  }
  EXPECT_EQ(notes["after_zero"], notes["start"]);
  EXPECT_EQ(notes["after_reset"], notes["start"]);
}

// The file's point that is nearest to the one that the page names.
void ExpectPointOfTheFile(const json& notes, const std::filesystem::path& cloud) {
  const std::string text = notes["text"];
  std::array<double, 3> xyz{};
  ASSERT_EQ(std::sscanf(text.c_str(), "Point at %lf, %lf, %lf", &xyz[0], &xyz[1], &xyz[2]), 3) << text;
  const auto distance = [&](const colmap_ext::CloudSample::Point& p) {
    return std::hypot(p.xyz[0] - xyz[0], p.xyz[1] - xyz[1], p.xyz[2] - xyz[2]);
  };
  const colmap_ext::CloudSample sample = colmap_ext::SampleCloud(cloud, kMaxPoints);
  const auto nearest = std::min_element(sample.points.begin(), sample.points.end(),
                                        [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  EXPECT_LT(distance(*nearest), 1e-3) << text;  // the page rounds to 15 bits
  Names seen_by;
  for (const int view : nearest->views) seen_by.push_back("room000" + std::to_string(view) + ".png");
  EXPECT_EQ(notes["images"].get<Names>(), seen_by) << text;
  EXPECT_EQ(notes["opened"], seen_by.at(0)) << "a click on the first name opens it";
  EXPECT_THAT(text, HasSubstr(nearest->inferred ? ", inferred" : ", measured"));
  EXPECT_TRUE(notes["marked"]);
}

void ExpectImagesOpen(const json& images) {
  for (const json& image : images) {
    EXPECT_EQ(image["name"], image["wanted"]) << image["act"];
    EXPECT_EQ(image["thumbnail"], image["wanted"]) << image["act"];
    EXPECT_EQ(image["pictures"][0], image["wanted"] == "room0003.png" ? "Raw depth" : "Input") << image["act"];
  }
}

void ExpectEnlarged(const json& viewer) {
  const Names layers = viewer["layers"].get<Names>();
  ASSERT_GT(layers.size(), 4u);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    for (const char* by : {"keys", "buttons"}) {
      EXPECT_EQ(viewer[by][i]["layer"], layers[i]) << by;
      EXPECT_THAT(viewer[by][i]["caption"].get<std::string>(), testing::StartsWith(layers[i]));
      EXPECT_EQ(viewer[by][i]["box"], viewer["fit"]) << layers[i] << " lies where the others lie";
    }
  }
  EXPECT_EQ(viewer["left"], layers.back()) << "from the first to the left";
  EXPECT_GT(viewer["wheel"][2], viewer["fit"][2]);
  EXPECT_EQ(viewer["drag"], json({viewer["wheel"][0].get<int>() + 30, viewer["wheel"][1].get<int>() + 20, viewer["wheel"][2]}));
  EXPECT_EQ(viewer["again"], viewer["fit"]);
  for (const char* state : {"escape", "reopened", "closed"}) EXPECT_TRUE(viewer[state]) << state;
}

void ExpectOrders(const json& sorting, json images) {
  EXPECT_GT(sorting.size(), 8u);
  for (const auto& [heading, key] : {std::pair{"image", "name"}, {"measured %", "measured"}, {"pixel size", "pixel_size"}}) {
    std::stable_sort(images.begin(), images.end(), [key = key](const json& a, const json& b) { return a[key] < b[key]; });
    Names order;
    for (const json& image : images) order.push_back(image["name"]);
    EXPECT_EQ(sorting[heading]["ascending"].get<Names>(), order) << heading;
    std::reverse(order.begin(), order.end());
    EXPECT_EQ(sorting[heading]["descending"].get<Names>(), order) << heading;
    EXPECT_EQ(sorting[heading]["mark"], "descending");
  }
  for (const char* direction : {"ascending", "descending"}) {
    EXPECT_EQ(sorting["warnings"][direction][0], "room0003.png") << "the images without one come last: " << direction;
  }
}

// Every control of the page, in a real browser.
TEST(ReportReader, FindsThatEveryControlWorks) {
  const std::string browser = test_support::FindBrowser();
  if (browser.empty()) GTEST_SKIP() << "no chromium on PATH";
  const test_support::TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(WriteRoomReport(folder.path()));
  const json notes = ReadAsAReader(folder.path(), browser);
  if (notes.is_null()) GTEST_SKIP() << "the browser gave nothing within five minutes";
  ASSERT_TRUE(notes.contains("errors"));
  ASSERT_EQ(notes["errors"], json::array()) << "in " << notes["part"];
  ASSERT_EQ(notes["part"], "end");
  EXPECT_EQ(notes["unused"], json::array()) << "controls that this test does not use";
  ExpectCloudChanges(notes);
  ExpectPointOfTheFile(notes["point"], folder / "room/dense/fused.ply");
  EXPECT_EQ(notes["no_point"], "Click a point or a camera.");
  EXPECT_EQ(notes["camera"]["opened"], notes["camera"]["wanted"]);
  ExpectImagesOpen(notes["images"]);
  ExpectEnlarged(notes["viewer"]);
  const std::string data = Between(ReadBytes(folder / "report.html"), "<script id=\"data\" type=\"application/json\">", "</script>");
  ExpectOrders(notes["sorting"], json::parse(data)["images"]);
  for (const json& table : notes["details"]) {
    EXPECT_GT(table["rows"], 1);
    EXPECT_GT(table["height"], 10) << "opened";
  }
}

}  // namespace

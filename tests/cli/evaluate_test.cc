#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "colmap_ext/evaluation/ply_rows.h"
#include "phi/base/random.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/map_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_data.h"

namespace {

using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using testing::ElementsAre;
using testing::HasSubstr;

ProgramResult Evaluate(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {PHIMVS_BINARY, "evaluate"});
  return RunProgram(arguments);
}

// A plane of 50 x 50 points at height z.
std::string PlanePly(double z) {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 2500\nproperty float x\nproperty float y\nproperty float "
      "z\nend_header\n";
  for (int i = 0; i < 2500; ++i) {
    text += std::to_string(0.01 * (i % 50) + 0.003) + " " + std::to_string(0.01 * (i / 50) + 0.003) + " " +
            std::to_string(z) + "\n";
  }
  return text;
}

TEST(EvaluateCommand, ScoresAnOffsetPlaneAndWritesJson) {
  const TemporaryFolder folder;
  WriteBytes(folder / "truth.ply", PlanePly(0));
  WriteBytes(folder / "cloud.ply", PlanePly(0.03));
  const ProgramResult result =
      Evaluate({"--cloud_path", folder / "cloud.ply", "--truth_path", folder / "truth.ply", "--tolerances",
                "0.01,0.02,0.05,0.1", "--output_path", folder / "e.json", "--table", "markdown"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("| 0.05      |     100.00 |         100.00 | 100.00 |"));
  const auto json = nlohmann::json::parse(ReadBytes(folder / "e.json"));
  EXPECT_THAT(json["tolerances"], ElementsAre(0.01, 0.02, 0.05, 0.1));
  EXPECT_THAT(json["accuracy"], ElementsAre(0.0, 0.0, 100.0, 100.0));
  EXPECT_THAT(json["completeness"], ElementsAre(0.0, 0.0, 100.0, 100.0));
  EXPECT_THAT(json["f1"], ElementsAre(0.0, 0.0, 100.0, 100.0));
}

TEST(EvaluateCommand, ScoresReplaceNoCloud) {
  const TemporaryFolder folder;
  WriteBytes(folder / "cloud.ply", PlanePly(0));
  const std::string cloud = folder / "cloud.ply", scores = folder / "e.json";
  const auto evaluate = [&](const std::string& output) {
    return Evaluate({"--cloud_path", cloud, "--truth_path", cloud, "--output_path", output});
  };
  const ProgramResult refused = evaluate(cloud);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.errors, HasSubstr(cloud + " is no table of scores, and would be replaced by one; choose another name"));
  EXPECT_EQ(ReadBytes(cloud), PlanePly(0));
  WriteBytes(scores, "");
  for (int i = 0; i < 2; ++i) EXPECT_EQ(evaluate(scores).exit_code, 0) << "over an empty file, and its own";
}

// One inferred point 3 cm above the truth, three measured ones on it, each in its own voxel.
TEST(EvaluateCommand, ScoresInferredPointsApart) {
  const TemporaryFolder folder;
  WriteBytes(folder / "truth.ply", PlanePly(0));
  WriteBytes(folder / "cloud.ply",
             "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
             "property uchar inferred\nend_header\n0.003 0.003 0 0\n0.103 0.003 0 0\n0.203 0.003 0 0\n"
             "0.303 0.003 0.03 1\n");
  const std::vector<std::string> words{
      "--cloud_path",  folder / "cloud.ply", "--truth_path",     folder / "truth.ply",
      "--tolerances",  "0.02,0.05",          "--inferred_apart", "true",
      "--output_path", folder / "e.json",    "--table",          "markdown"};
  const ProgramResult result = Evaluate(words);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("accuracy of 3 measured and 1 inferred points"));
  const auto json = nlohmann::json::parse(ReadBytes(folder / "e.json"));
  EXPECT_THAT(json["accuracy"], ElementsAre(75.0, 100.0));
  EXPECT_THAT(json["measured"]["accuracy"], ElementsAre(100.0, 100.0));
  EXPECT_THAT(json["inferred"]["accuracy"], ElementsAre(0.0, 100.0));
  EXPECT_EQ(json["inferred"]["num_counted"], 1);

  WriteBytes(folder / "cloud.ply", PlanePly(0.03));
  const ProgramResult foreign = Evaluate(words);
  EXPECT_EQ(foreign.exit_code, 2);
  EXPECT_THAT(foreign.errors, HasSubstr("--inferred_apart"));
  const ProgramResult raw = Evaluate({"--depth_maps", folder.path(), "--truth_depth_maps", folder.path(),
                                      "--map_type", "photometric", "--inferred_apart", "true"});
  EXPECT_EQ(raw.exit_code, 1);
  EXPECT_THAT(raw.errors, HasSubstr("geometric"));
}

// Four true points, a metre apart: one image sees the first, two the second, three the third, five the last. The cloud
// has the first two, 1.5 cm off, and the last; and a point above them all that lies on no surface, as one in the sky.
TEST(EvaluateCommand, ScoresByViewsAndCountsPointsInTheSkyAsWrong) {
  const TemporaryFolder folder;
  const std::string head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n";
  WriteBytes(folder / "truth.ply", head +
                                       "property float z\nproperty uchar views\nend_header\n"
                                       "0.003 0 0 1\n1.003 0 0 2\n2.003 0 0 3\n3.003 0 0 5\n");
  WriteBytes(folder / "cloud.ply",
             head + "property float z\nend_header\n0.003 0 0.015\n1.003 0 0.015\n3.003 0 0\n2.003 0 40\n");
  const std::vector<std::string> words{"--cloud_path",  folder / "cloud.ply",
                                       "--truth_path",  folder / "truth.ply",
                                       "--tolerances",  "0.01,0.02",
                                       "--output_path", folder / "e.json",
                                       "--table",       "markdown"};
  const ProgramResult result = Evaluate(words);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("| 4-5     |               1 |        100.00 |        100.00 |"));
  const auto json = nlohmann::json::parse(ReadBytes(folder / "e.json"));
  EXPECT_THAT(json["accuracy"], ElementsAre(25.0, 75.0)) << "the point in the sky counts, and is wrong";
  EXPECT_THAT(json["completeness"], ElementsAre(25.0, 75.0));
  EXPECT_FALSE(json.contains("accuracy_of_all")) << "nothing was left out";
  ASSERT_EQ(json["by_views"].size(), 4u);
  const std::vector<std::string> names{"0-1", "2", "3", "4-5"};
  const std::vector<std::vector<double>> completeness{{0, 100}, {0, 100}, {0, 0}, {100, 100}};
  for (int c = 0; c < 4; ++c) {
    EXPECT_EQ(json["by_views"][c]["views"], names[c]);
    EXPECT_EQ(json["by_views"][c]["num_truth"], 1);
    EXPECT_EQ(json["by_views"][c]["completeness"], completeness[c]) << names[c];
  }

  std::vector<std::string> two = words;
  two.insert(two.end(), {"--min_truth_views", "2"});
  ASSERT_EQ(Evaluate(two).exit_code, 0);
  const auto seen_twice = nlohmann::json::parse(ReadBytes(folder / "e.json"));
  EXPECT_EQ(seen_twice["num_truth"], 3);
  EXPECT_THAT(seen_twice["accuracy"], ElementsAre(25.0, 50.0))
      << "the first point's surface is not asked for";
  EXPECT_THAT(seen_twice["accuracy_of_all"], ElementsAre(25.0, 75.0)) << "but it is there";
  EXPECT_EQ(seen_twice["by_views"][0]["views"], "2") << "what one image sees was left out";

  WriteBytes(folder / "truth.ply", PlanePly(0));
  ASSERT_EQ(Evaluate(words).exit_code, 0);
  EXPECT_FALSE(nlohmann::json::parse(ReadBytes(folder / "e.json")).contains("by_views"));
}

// From fusion to the scores, in UTM: the cloud is in single precision from an offset, the truth in doubles.
TEST(EvaluateCommand, ScoresCloudsFarFromTheOrigin) {
  const TemporaryFolder folder;
  auto scene = test_support::PlaneScene();
  colmap_ext::Similarity shift;
  shift.translation = {500000, 5300000, 400};
  Transform(shift, &scene);
  test_support::WriteMapWorkspace(scene, folder / "dense");
  const ProgramResult fusion = RunProgram(
      {PHIMVS_BINARY, "stereo_fusion", "--workspace_path", folder / "dense", "--output_path", folder / "c.ply"});
  ASSERT_EQ(fusion.exit_code, 0) << fusion.errors;
  EXPECT_THAT(fusion.errors, HasSubstr("c.ply: positions are from the offset 500000 5300000 400"));
  // The plane through (0, 0, 4) at right angles to (0.4, -0.2, -1), wider than the images see it.
  std::string truth;
  int num_points = 0;
  for (double x = -5; x <= 5; x += 0.05) {
    for (double y = -5; y <= 5; y += 0.05, ++num_points)
      truth += std::to_string(500000 + x) + " " + std::to_string(5300000 + y) + " " +
               std::to_string(404 + 0.4 * x - 0.2 * y) + "\n";
  }
  WriteBytes(folder / "truth.ply", "ply\nformat ascii 1.0\nelement vertex " + std::to_string(num_points) +
                                       "\nproperty double x\nproperty double y\nproperty double z\nend_header\n" + truth);
  const std::vector<std::string> words{"--cloud_path", folder / "c.ply",  "--truth_path",  folder / "truth.ply",
                                       "--tolerances", "0.02,0.05",       "--output_path", folder / "e.json"};
  const ProgramResult result = Evaluate(words);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("c.ply: the offset 500000 5300000 400"));
  const auto json = nlohmann::json::parse(ReadBytes(folder / "e.json"));
  EXPECT_GT(json["accuracy"][1].get<double>(), 99);
  EXPECT_GT(json["completeness"][1].get<double>(), 10);
  EXPECT_EQ(json["num_points"], json["num_counted"]);

  std::vector<std::string> covered = words;
  covered.insert(covered.end(), {"--coverage_workspace_path", folder / "dense", "--truth_depth_maps",
                                 folder / "dense/stereo/depth_maps"});
  ASSERT_EQ(Evaluate(covered).exit_code, 0);
  const auto of_covered = nlohmann::json::parse(ReadBytes(folder / "e.json"));
  EXPECT_GT(of_covered["num_counted"].get<int>(), of_covered["num_points"].get<int>() * 99 / 100);
}

TEST(EvaluateCommand, SaysWhatIsMissing) {
  const ProgramResult none = Evaluate({});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.errors, HasSubstr("--cloud_path"));
  const ProgramResult half = Evaluate({"--cloud_path", "a.ply"});
  EXPECT_EQ(half.exit_code, 1);
  EXPECT_THAT(half.errors, HasSubstr("--truth_path"));
  const ProgramResult absent = Evaluate({"--cloud_path", "a.ply", "--truth_path", "/nowhere/t.ply"});
  EXPECT_EQ(absent.exit_code, 2);
  EXPECT_THAT(absent.errors, HasSubstr("/nowhere/t.ply"));
  const ProgramResult words =
      Evaluate({"--cloud_path", "a.ply", "--truth_path", "b.ply", "--tolerances", "0.1,x"});
  EXPECT_EQ(words.exit_code, 1);
  EXPECT_THAT(words.errors, HasSubstr("--tolerances"));
}

// A negative beam left nothing observed, or nothing free: scores of 0 in silence.
TEST(EvaluateCommand, RefusesBeamsThatAreNone) {
  for (const char* option : {"--beam_start_radius", "--beam_divergence_half_angle"}) {
    const ProgramResult result = Evaluate({"--cloud_path", "a.ply", "--truth_path", "b.ply", option, "-1"});
    EXPECT_EQ(result.exit_code, 1) << option;
    EXPECT_THAT(result.errors, HasSubstr(option));
  }
  EXPECT_EQ(Evaluate({"--cloud_path", "a.ply", "--truth_path", "b.ply", "--beam_divergence_half_angle", "90"}).exit_code, 1);
}

// A scene's truth, disturbed: every third point, noise of up to 4 cm along each axis.
void WriteNoisyTruth(const std::filesystem::path& truth, const std::filesystem::path& cloud) {
  std::string body;
  std::uint64_t index = 0, count = 0;
  colmap_ext::PlyRows(truth).ForEachRow("vertex", {"x", "y", "z"}, [&](const double* v) {
    const phi::Random4 r = phi::Philox({7, 0}, index, 0, 0);
    if (index++ % 3 != 0) return;
    const float scale = 0.04f * phi::UniformFloat(r.v[3]);
    for (int axis = 0; axis < 3; ++axis) {
      const float value = static_cast<float>(v[axis]) + scale * phi::SymmetricFloat(r.v[axis]);
      body.append(reinterpret_cast<const char*>(&value), sizeof(value));
    }
    ++count;
  });
  WriteBytes(cloud, "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) +
                        "\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + body);
}

// A copy of the truth with the first point of each voxel of 1 cm alone. We average completeness over voxels as
// ETH3D does, the reference over points; the definitions meet where a voxel holds one point.
void WriteOnePointAVoxel(const std::filesystem::path& truth, const std::filesystem::path& thinned) {
  std::set<std::array<std::int64_t, 3>> voxels;
  std::string body;
  std::uint64_t count = 0;
  colmap_ext::PlyRows(truth).ForEachRow("vertex", {"x", "y", "z", "views"}, [&](const double* v) {
    std::array<std::int64_t, 3> voxel;
    for (int axis = 0; axis < 3; ++axis) voxel[axis] = static_cast<std::int64_t>(std::floor(v[axis] / 0.01));
    if (!voxels.insert(voxel).second) return;
    for (int axis = 0; axis < 3; ++axis) {
      const float value = static_cast<float>(v[axis]);
      body.append(reinterpret_cast<const char*>(&value), sizeof(value));
    }
    body.push_back(static_cast<char>(static_cast<std::uint8_t>(v[3])));
    ++count;
  });
  WriteBytes(
      thinned,
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) +
          "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar views\nend_header\n" +
          body);
}

class AgreesWithReference : public testing::TestWithParam<const char*> {};

TEST_P(AgreesWithReference, WithinATenthOfAPoint) {
  const std::string name = GetParam();
  const std::filesystem::path scene = test_support::FindScene(GetParam());
  if (scene.empty()) GTEST_SKIP() << "scene " << name << " is not there (PHIMVS_TEST_DATA)";
  if (RunProgram({"python3", "-c", "import numpy, scipy, PIL"}).exit_code != 0) {
    GTEST_SKIP() << "the reference needs python3 with numpy, scipy and Pillow";
  }
  // The reference scores against the scene beside its own file.
  const TemporaryFolder folder;
  const std::filesystem::path reference = folder / "reference_evaluation.py";
  std::filesystem::copy_file(scene.parent_path() / "reference_evaluation.py", reference);
  const std::filesystem::path copy = folder / name, truth = copy / "gt/truth.ply";
  std::filesystem::create_directories(copy / "gt");
  std::filesystem::create_directory_symlink(scene / "dense", copy / "dense");
  std::filesystem::create_directory_symlink(scene / "gt/depth_u16", copy / "gt/depth_u16");
  for (const auto& entry : std::filesystem::directory_iterator(scene / "gt")) {
    if (entry.path().extension() == ".ply") WriteOnePointAVoxel(entry.path(), truth);
  }
  WriteNoisyTruth(truth, folder / "cloud.ply");
  std::vector<std::string> arguments{"--cloud_path",  folder / "cloud.ply", "--truth_path",
                                     truth,           "--min_truth_views",  "2",
                                     "--output_path", folder / "e.json"};
  if (name == "fountain") {
    const std::vector<std::string> coverage{"--coverage_workspace_path", scene / "dense",
                                            "--truth_depth_maps",        scene / "gt/depth_u16",
                                            "--truth_depth_scale",       "4000"};
    arguments.insert(arguments.end(), coverage.begin(), coverage.end());
  }
  const ProgramResult ours = Evaluate(arguments);
  ASSERT_EQ(ours.exit_code, 0) << ours.errors;
  const ProgramResult theirs = RunProgram({"python3", reference, name, "cloud", folder / "cloud.ply"});
  ASSERT_EQ(theirs.exit_code, 0) << theirs.errors;

  const auto json = nlohmann::json::parse(ReadBytes(folder / "e.json"));
  const std::regex row("cm +A +([0-9.]+) +C +([0-9.]+) +F1 +([0-9.]+)");
  std::size_t t = 0;
  for (std::sregex_iterator it(theirs.output.begin(), theirs.output.end(), row), end; it != end; ++it, ++t) {
    EXPECT_NEAR(json["accuracy"][t].get<double>(), std::stod((*it)[1]), 0.1);
    EXPECT_NEAR(json["completeness"][t].get<double>(), std::stod((*it)[2]), 0.1);
    EXPECT_NEAR(json["f1"][t].get<double>(), std::stod((*it)[3]), 0.1);
  }
  EXPECT_EQ(t, 4u) << theirs.output;
  EXPECT_LT(json["f1"][0].get<double>(), 99) << "the disturbed cloud should not score full marks";
}

INSTANTIATE_TEST_SUITE_P(Scenes, AgreesWithReference, testing::Values("livingroom", "fountain", "corridor"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace

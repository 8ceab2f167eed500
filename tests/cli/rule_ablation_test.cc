// scripts/ablation --rules: which runs there are, in which order, and from which maps. All of the program is a stand-in that keeps
// a diary; what the scores are worth is tested with the benchmark's scripts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

namespace fs = std::filesystem;
using Lines = std::vector<std::string>;

// Diary: "begins", "ends" and "scored", each with set, seed and the rules' settings. Files beside it change what happens to a
// "SET SEED SETTING" of stereo: lines of `fail` end with code 3, lines of `sleep` last a minute, and lines of `late` last until a
// run of view_coverage has begun.
constexpr char kStandIn[] = R"(
listed() { grep -qsxF "$what" "$here/$1"; }
case $1 in
version) echo stand-in ;;
patch_match_stereo)
  what="$(cat "$3/sparse/name") $5 ${7:-as_is}"
  from=photos; [ ! -e "$3/stereo/depth_maps/estimate.bin" ] || from=estimates
  echo "begins $what from $from, GPU $CUDA_VISIBLE_DEVICES" >> "$here/diary"
  listed fail && { echo it failed on purpose; exit 3; }
  listed sleep && exec sleep 60
  tries=0
  while listed late && ! grep -q 'begins .* view_coverage' "$here/diary"; do
    sleep 0.05; tries=$((tries + 1)); [ $tries -lt 600 ] || exit 4
  done
  mkdir -p "$3/stereo/depth_maps"
  [ $from = estimates ] || echo > "$3/stereo/depth_maps/estimate.bin"
  echo "$what" > "$3/stereo/what"
  echo "ends $what" >> "$here/diary" ;;
stereo_fusion) echo "$(cat "$3/stereo/what") $9" > "$5" ;;
evaluate)
  what=$(cat "$3"); score=90
  case $what in *sky=0\ *) score=80 ;; esac
  for last; do :; done
  echo "{\"accuracy\": [$score, 95], \"completeness\": [$score, 95], \"num_points\": 1, \"by_views\": []}" > "$last"
  ls "$here/work/lanes" | wc -l >> "$here/lanes"
  echo "scored $what" | sed 's/ as_is \(.\)/ \1/; s/ *$//' >> "$here/diary" ;;
esac
)";

class RuleAblation : public testing::Test {
 protected:
  void SetUp() override {
    if (RunProgram({"python3", "--version"}).exit_code != 0) GTEST_SKIP() << "no python3 on PATH";
    nlohmann::json scenes = nlohmann::json::array();
    // Their photos are of 10, 30 and 20 bytes.
    int bytes[] = {10, 30, 20};
    for (std::size_t i = 0; i < sets_.size(); ++i) {
      const fs::path set = folder_ / "data" / sets_[i];
      WriteBytes(set / "truth.ply", "");
      WriteBytes(set / "dense/images/0.jpg", std::string(bytes[i], '.'));
      WriteBytes(set / "dense/sparse/name", sets_[i]);
      WriteBytes(set / "dense/stereo/patch-match.cfg", "");
      scenes.push_back({{"name", sets_[i]},
                        {"half", "judge"},
                        {"tolerances", {1, 2}},
                        {"voxel_size", 1},
                        {"variants", Lines()}});
    }
    WriteBytes(folder_ / "split.json", nlohmann::json{{"scenes", scenes}}.dump());
    WriteBytes(folder_ / "phimvs", "#!/bin/sh\nhere='" + folder_.path().string() + "'" + kStandIn);
    fs::permissions(folder_ / "phimvs", fs::perms::owner_all);
  }

  // `more` may say other rules and settings: the last word counts.
  ProgramResult Run(const Lines& more) const {
    Lines words{"python3",
                PHIMVS_SOURCE_DIR "/scripts/ablation",
                "--rules",
                "--phimvs",
                folder_ / "phimvs",
                "--data",
                folder_ / "data",
                "--split",
                folder_ / "split.json",
                "--halves",
                "judge",
                "--commit",
                "abc1234",
                "--work",
                folder_ / "work",
                "--output_path",
                folder_ / "rules",
                "--only",
                "view_coverage,first_hypotheses,own_texture,sky,cloud_holes",
                "--settings",
                "off,0.7"};
    words.insert(words.end(), more.begin(), more.end());
    return RunProgram(words, {"PYTHONDONTWRITEBYTECODE=1"});
  }

  // Lines of the diary that begin so, without that beginning.
  Lines Diary(const std::string& beginning) const {
    std::istringstream text(ReadBytes(folder_ / "diary"));
    Lines lines;
    for (std::string line; std::getline(text, line);) {
      if (line.starts_with(beginning)) lines.push_back(line.substr(beginning.size()));
    }
    return lines;
  }

  std::size_t LineOf(const std::string& beginning) const {
    const Lines lines = Diary("");
    const auto found =
        std::find_if(lines.begin(), lines.end(), [&](const auto& l) { return l.starts_with(beginning); });
    EXPECT_NE(found, lines.end()) << beginning;
    return static_cast<std::size_t>(found - lines.begin());
  }

  // Each setting of each set and seed, sorted.
  Lines All(const Lines& seeds, const Lines& settings) const {
    Lines all;
    for (const std::string& set : sets_) {
      for (const std::string& seed : seeds) {
        for (const std::string& setting : settings) all.push_back(set + " " + seed + " " + setting);
      }
    }
    std::sort(all.begin(), all.end());
    return all;
  }

  Lines Scored() const {
    Lines scored = Diary("scored ");
    std::sort(scored.begin(), scored.end());
    return scored;
  }

  void Forget(const std::string& setting, const std::string& set) const {
    auto results = nlohmann::json::parse(ReadBytes(folder_ / "rules/results.json"));
    results["rows"]["judge"][setting].erase(set);
    std::ofstream(folder_ / "rules/results.json") << results;
  }

  Lines FoldersOfWork() const {
    Lines folders;
    for (const char* parent : {"lanes", "judge"}) {
      if (!fs::exists(folder_ / "work" / parent)) continue;
      for (const auto& entry : fs::directory_iterator(folder_ / "work" / parent))
        folders.push_back(entry.path().filename());
    }
    return folders;
  }

  const Lines sets_{"one", "two", "three"};
  TemporaryFolder folder_;
};

const Lines kSettings{"as_is",   "view_coverage=0", "first_hypotheses=0", "own_texture=0",
                      "sky=0",   "cloud_holes=0",   "view_coverage=0.7",  "own_texture=0.7",
                      "sky=0.7", "cloud_holes=0.7"};

TEST_F(RuleAblation, EachRunIsMadeOnceFromTheMapsThatItNeeds) {
  // One set's maps take until the runs that need none are under way: no lane waits for them that has other things to do.
  WriteBytes(folder_ / "late", "two 0 as_is\n");
  const ProgramResult run = Run({"--seeds", "0,1", "--lanes", "5", "--gpus", "0,1"});
  ASSERT_EQ(run.exit_code, 0) << run.output << run.errors;
  EXPECT_EQ(Scored(), All({"0", "1"}, kSettings));
  EXPECT_EQ(Diary("ends ").size(), 6u * 8) << "maps, and all but the two of fusion";
  for (const std::string& of : All({"0", "1"}, {""})) {
    EXPECT_THAT(Diary("begins " + of), Contains(StartsWith("view_coverage=0.7 from photos")));
    EXPECT_THAT(Diary("begins " + of), Contains(StartsWith("first_hypotheses=0 from photos")));
    const std::size_t maps = LineOf("ends " + of + "as_is");
    EXPECT_GT(LineOf("scored " + of + "as_is"), maps);
    EXPECT_GT(LineOf("begins " + of + "own_texture=0 from estimates"), maps);
    EXPECT_GT(LineOf("begins " + of + "sky=0.7 from estimates"), maps);
    EXPECT_GT(LineOf("scored " + of + "cloud_holes=0"), maps);
  }
  EXPECT_THAT(Diary("begins "), AllOf(Contains(HasSubstr("GPU 0")), Contains(HasSubstr("GPU 1"))));
  std::istringstream lanes(ReadBytes(folder_ / "lanes"));
  for (int count = 0; lanes >> count;) EXPECT_LE(count, 5);
  EXPECT_THAT(FoldersOfWork(), ElementsAre());

  const auto rows = nlohmann::json::parse(ReadBytes(folder_ / "rules/rules.json"))["rows"];
  ASSERT_EQ(rows.size(), 9u);
  for (const auto& row : rows) {
    EXPECT_EQ(row["f1"][0], row["rule"] == "sky" && row["setting"] == "off" ? -10 : 0) << row;
    EXPECT_EQ(row["runs"], 6);
  }
}

TEST_F(RuleAblation, MapsGoFirstThenWholeSettingsLargePhotosBeforeSmallOnes) {
  const ProgramResult run = Run(
      {"--seeds", "0", "--lanes", "1", "--only", "view_coverage,sky,cloud_holes", "--settings", "1.4,off"});
  ASSERT_EQ(run.exit_code, 0) << run.output << run.errors;
  Lines expected;
  for (const char* setting : {"as_is", "sky=1.4", "view_coverage=1.4", "cloud_holes=1.4", "sky=0",
                              "view_coverage=0", "cloud_holes=0"}) {
    for (const char* set : {"two", "three", "one"}) expected.push_back(std::string(set) + " 0 " + setting);
  }
  EXPECT_EQ(Diary("scored "), expected);
  EXPECT_LT(LineOf("ends one 0 as_is"), LineOf("scored two 0 as_is"));
}

TEST_F(RuleAblation, GoesOnWithWhatIsMissingAndMakesOnlyMapsThatItNeeds) {
  const Lines words{"--seeds", "0", "--lanes", "3"};
  ASSERT_EQ(Run(words).exit_code, 0);
  const std::string diary = ReadBytes(folder_ / "diary");
  ASSERT_EQ(Run(words).exit_code, 0);
  EXPECT_EQ(ReadBytes(folder_ / "diary"), diary) << "nothing runs twice";
  Forget("cloud_holes=0", "two");
  Forget("view_coverage=0", "one");
  WriteBytes(folder_ / "diary", "");
  ASSERT_EQ(Run(words).exit_code, 0);
  EXPECT_THAT(Scored(), ElementsAre("one 0 view_coverage=0", "two 0 cloud_holes=0"));
  EXPECT_EQ(Diary("ends ").size(), 2u) << "one's maps are not made";
  EXPECT_LT(LineOf("ends two 0 as_is"), LineOf("scored two 0 cloud_holes=0"));
}

TEST_F(RuleAblation, TheTimesEndStopsWhatIsUnderWayAndLeavesTheRest) {
  WriteBytes(folder_ / "sleep", "two 0 view_coverage=0\nthree 0 sky=0\n");
  const Lines words{"--seeds", "0", "--lanes", "2"};
  const auto begin = std::chrono::steady_clock::now();
  const ProgramResult stopped = Run({"--seeds", "0", "--lanes", "2", "--time_limit", "4"});
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(50));
  EXPECT_EQ(stopped.exit_code, 0) << stopped.errors;
  EXPECT_THAT(stopped.output, HasSubstr("the time was up"));
  EXPECT_LT(Scored().size(), 30u);
  std::size_t kept = 0;
  const auto results = nlohmann::json::parse(ReadBytes(folder_ / "rules/results.json"));
  for (const auto& of_setting : results["rows"]["judge"]) kept += of_setting.size();
  EXPECT_EQ(kept, Scored().size());
  EXPECT_THAT(FoldersOfWork(), Contains("three_seed0")) << "for the next call";
  EXPECT_FALSE(fs::exists(folder_ / "work/lanes/0"));

  fs::remove(folder_ / "sleep");
  const ProgramResult rest = Run(words);
  ASSERT_EQ(rest.exit_code, 0) << rest.output << rest.errors;
  EXPECT_EQ(Scored(), All({"0"}, kSettings));
  EXPECT_EQ(Diary("begins three 0 as_is from photos").size(), 1u) << "the first call's maps";
  EXPECT_THAT(FoldersOfWork(), ElementsAre());
}

TEST_F(RuleAblation, WhatFailsIsToldAndTheOthersGoOn) {
  WriteBytes(folder_ / "fail", "two 0 view_coverage=0.7\nthree 0 as_is\n");
  const Lines words{"--seeds", "0", "--lanes", "2"};
  const ProgramResult failed = Run(words);
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.errors, HasSubstr("judge two seed 0 view_coverage=0.7: RuntimeError: exit code 3"));
  EXPECT_THAT(failed.errors, HasSubstr("it failed on purpose"));
  EXPECT_THAT(failed.errors, HasSubstr("judge three seed 0 maps as they are: RuntimeError: exit code 3"));
  // All of three's ten but view_coverage off and scaled, and first_hypotheses.
  EXPECT_THAT(failed.errors, HasSubstr("7 runs that start from them are left out"));
  EXPECT_THAT(failed.errors, HasSubstr("9 failed or were left out"));
  EXPECT_EQ(Scored().size(), 22u);
  EXPECT_THAT(Scored(), Contains("three 0 first_hypotheses=0"));
  EXPECT_THAT(FoldersOfWork(), ElementsAre("three_seed0")) << "two's failure needed no maps";
  EXPECT_THAT(ReadBytes(folder_ / "rules/rules.md"),
              HasSubstr("| sky | off | judge | -10.00 | +0.00 | one |"));

  fs::remove(folder_ / "fail");
  const ProgramResult mended = Run(words);
  ASSERT_EQ(mended.exit_code, 0) << mended.errors;
  EXPECT_THAT(mended.errors, Not(HasSubstr("failed")));
  EXPECT_EQ(Scored(), All({"0"}, kSettings));
}

}  // namespace

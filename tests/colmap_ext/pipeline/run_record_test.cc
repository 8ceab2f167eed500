#include "colmap_ext/pipeline/run_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <utility>

#include <nlohmann/json.hpp>

#include "phi/base/error.h"
#include "tests/support/error_message.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::FileSizeLimit;
using ::testing::HasSubstr;

class RunRecordTest : public ::testing::Test {
 protected:
  std::filesystem::path Json() const { return folder_ / "phimvs.json"; }
  std::filesystem::path Journal() const { return folder_ / "phimvs.json.journal"; }
  TaskRecord Done(const std::string& key) const { return {"done", key, 1.5, 1000, {"a warning"}}; }

  test_support::TemporaryFolder folder_;
};

TEST_F(RunRecordTest, RemembersAcrossProcesses) {
  {
    RunRecord record(folder_.path());
    EXPECT_FALSE(record.Find("a", "photometric"));
    record.SetOptions({{"log_level", "2"}}, "hash");
    record.Begin({{"sub/ä.png", "photometric"}, {"b", "photometric"}}, {"k1", "k2"});
    record.Finish({"sub/ä.png", "photometric"}, Done("k1"));
  }
  RunRecord record(folder_.path());
  const auto done = record.Find("sub/ä.png", "photometric");
  ASSERT_TRUE(done);
  EXPECT_EQ(done->state, "done");
  EXPECT_EQ(done->key, "k1");
  EXPECT_DOUBLE_EQ(done->seconds, 1.5);
  EXPECT_EQ(done->peak_memory_bytes, 1000);
  EXPECT_EQ(done->warnings, std::vector<std::string>{"a warning"});
  ASSERT_TRUE(record.Find("b", "photometric"));
  EXPECT_EQ(record.Find("b", "photometric")->state, "pending");
}

// Writers finish tasks while others look at what was known of them.
TEST_F(RunRecordTest, WhatWasFoundStaysAsItWasFound) {
  RunRecord record(folder_.path());
  record.Begin({{"a", "photometric"}}, {"k1"});
  const auto found = record.Find("a", "photometric");
  record.Finish({"a", "photometric"}, Done("k1"));
  EXPECT_EQ(found->state, "pending");
  EXPECT_EQ(record.Find("a", "photometric")->state, "done");
}

// The result of the next line gets its files' names, and must be found again.
TEST_F(RunRecordTest, ALineThatFoundNoSpaceLeavesTheNextOneWhole) {
  RunRecord record(folder_.path());
  record.Begin({{"a", "photometric"}, {"b", "photometric"}, {"c", "photometric"}}, {"k1", "k2", "k3"});
  record.Finish({"a", "photometric"}, Done("k1"));
  {
    const FileSizeLimit limit(std::filesystem::file_size(Journal()) + 10);
    EXPECT_THROW(record.Finish({"b", "photometric"}, Done("k2")), phi::ResourceError);
  }
  record.Finish({"c", "photometric"}, Done("k3"));
  const RunRecord next(folder_.path());
  EXPECT_EQ(next.Find("a", "photometric")->state, "done");
  EXPECT_EQ(next.Find("b", "photometric")->state, "pending");
  EXPECT_EQ(next.Find("c", "photometric")->state, "done");
}

// It would say of no shard whose it is, and stay.
TEST_F(RunRecordTest, AShardThatFindsNoSpaceLeavesNoEmptyJournal) {
  RunRecord record(folder_.path());
  record.BeginShard({.shard = "0/2"});
  {
    const FileSizeLimit limit(10);
    EXPECT_THROW(record.Begin({{"a", "photometric"}}, {"k1"}), phi::ResourceError);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "phimvs.shards"));
}

// One was killed after its last image, another before its first line. Who does the shard again has nothing left to do.
TEST_F(RunRecordTest, JournalsOfKilledShardsGoThoughTheirSuccessorsHaveNothingToDo) {
  {
    RunRecord killed(folder_.path());
    killed.BeginShard({.shard = "0/2", .only_stage = "photometric"});
    killed.Begin({{"a", "photometric"}}, {"k1"});
    killed.Finish({"a", "photometric"}, Done("k1"));
  }
  std::ofstream(folder_ / "phimvs.shards/1-of-2.0.journal");
  for (const auto& [shard, stage] : {std::pair("0/2", "photometric"), {"1/2", "measured"}}) {
    RunRecord successor(folder_.path());
    successor.Refresh();
    successor.BeginShard({.shard = shard, .only_stage = stage});
    successor.Begin({}, {});
    successor.Compact();
  }
  RunRecord whole(folder_.path());
  whole.Refresh();
  EXPECT_EQ(whole.Find("a", "photometric")->state, "done");
  whole.Compact();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "phimvs.shards"));
}

TEST_F(RunRecordTest, JsonHoldsVersionOptionsAndTasks) {
  RunRecord record(folder_.path());
  record.SetOptions({{"log_level", "2"}}, "hash");
  record.Begin({{"a", "measured"}}, {"k"});
  record.Finish({"a", "measured"}, Done("k"));
  record.Compact();
  EXPECT_FALSE(std::filesystem::exists(Journal()));
  const auto json = nlohmann::json::parse(test_support::ReadBytes(Json()));
  EXPECT_EQ(json["version"], PHIMVS_VERSION);
  EXPECT_EQ(json["options"]["log_level"], "2");
  EXPECT_EQ(json["options_hash"], "hash");
  EXPECT_EQ(json["images"]["a"]["measured"]["state"], "done");
  EXPECT_EQ(json["images"]["a"]["measured"]["seconds"], 1.5);
}

TEST_F(RunRecordTest, KeepsTheLastRuns) {
  for (int run = 0; run < 23; ++run) {
    RunRecord record(folder_.path());
    record.AddRun(R"({"seconds": )" + std::to_string(run) + "}");
    record.Compact();
  }
  const auto runs = nlohmann::json::parse(test_support::ReadBytes(Json()))["runs"];
  ASSERT_EQ(runs.size(), 20u);
  EXPECT_EQ(runs[0]["seconds"], 3);
  EXPECT_EQ(runs[19]["seconds"], 22);
}

TEST_F(RunRecordTest, FinishingATaskDoesNotRewriteTheFile) {
  RunRecord record(folder_.path());
  record.Begin({{"a", "measured"}, {"b", "measured"}}, {"k", "l"});
  const std::string before = test_support::ReadBytes(Json());
  record.Finish({"a", "measured"}, Done("k"));
  const auto first = std::filesystem::file_size(Journal());
  record.Finish({"b", "measured"}, Done("l"));
  EXPECT_EQ(std::filesystem::file_size(Journal()), 2 * first);
  EXPECT_EQ(test_support::ReadBytes(Json()), before);
}

TEST_F(RunRecordTest, TornLastLineOfTheJournalIsIgnored) {
  {
    RunRecord record(folder_.path());
    record.Begin({{"a", "measured"}, {"b", "measured"}}, {"k", "l"});
    record.Finish({"a", "measured"}, Done("k"));
    record.Finish({"b", "measured"}, Done("l"));
  }
  std::filesystem::resize_file(Journal(), std::filesystem::file_size(Journal()) - 5);
  RunRecord record(folder_.path());
  EXPECT_EQ(record.Find("a", "measured")->state, "done");
  EXPECT_EQ(record.Find("b", "measured")->state, "pending");
}

TEST_F(RunRecordTest, JournalLinesOfAnotherShapeAreIgnored) {
  test_support::WriteBytes(
      Journal(),
      "null\n5\n{\"a\": 1}\n{\"image\": 5, \"kind\": \"measured\"}\n"
      "{\"image\": \"a\", \"kind\": \"measured\", \"sta{\"image\": \"b\"}\n"
      "{\"image\": \"c\", \"kind\": \"measured\", \"state\": \"done\", \"key\": \"k\"}\n");
  RunRecord record(folder_.path());
  EXPECT_FALSE(record.Find("a", "measured"));
  ASSERT_TRUE(record.Find("c", "measured"));
  EXPECT_EQ(record.Find("c", "measured")->state, "done");
}

// Latin-1 names, and names that look like what stands for them.
TEST_F(RunRecordTest, NamesNeedNotBeUtf8) {
  const std::vector<std::string> names = {"caf\xE9.jpg",  "caf\xE8.jpg", "caf\xC3\xA9.jpg",
                                          "caf\\xE9.jpg", "a\\b",        "\\x"};
  {
    RunRecord record(folder_.path());
    for (const std::string& name : names) record.Finish({name, "measured"}, Done("journal " + name));
  }
  RunRecord replayed(folder_.path());
  for (const std::string& name : names) {
    ASSERT_TRUE(replayed.Find(name, "measured")) << name;
    replayed.Finish({name, "measured"}, Done("key " + std::to_string(&name - names.data())));
  }
  replayed.Compact();
  const RunRecord compacted(folder_.path());
  for (const std::string& name : names) {
    ASSERT_TRUE(compacted.Find(name, "measured")) << name;
    EXPECT_EQ(compacted.Find(name, "measured")->key, "key " + std::to_string(&name - names.data()));
  }
  EXPECT_EQ(nlohmann::json::parse(test_support::ReadBytes(Json()))["images"].size(), names.size());
}

TEST_F(RunRecordTest, AFinishedWorkspaceIsNotWrittenAgain) {
  {
    RunRecord record(folder_.path());
    record.SetOptions({{"log_level", "2"}}, "hash");
    record.Finish({"a", "measured"}, Done("k"));
    record.Compact();
  }
  const std::string before = test_support::ReadBytes(Json());
  RunRecord record(folder_.path());
  record.SetOptions({{"log_level", "3"}}, "hash");
  record.Forget({"a", "raw"});
  record.Compact();
  EXPECT_EQ(test_support::ReadBytes(Json()), before);
  record.SetOptions({{"log_level", "3"}}, "other hash");
  record.Compact();
  EXPECT_NE(test_support::ReadBytes(Json()), before);
}

// What a killed process may have left under a result's names: files of the run before, or those of this one.
TEST_F(RunRecordTest, KnowsTheFilesOfEarlierRunsUntilTheyAreReplaced) {
  TaskRecord first = Done("k"), second = Done("l");
  first.files = {{10, 1, "aa"}};
  second.files = {{10, 2, "bb"}};
  {
    RunRecord record(folder_.path());
    record.Finish({"a", "measured"}, first);
    record.Begin({{"a", "measured"}}, {"l"});
  }
  {
    RunRecord begun(folder_.path());
    EXPECT_TRUE(begun.Find("a", "measured")->files.empty());
    ASSERT_EQ(begun.Find("a", "measured")->earlier.size(), 1u);
    EXPECT_EQ(begun.Find("a", "measured")->earlier[0].Text(), "10 1 aa");
    begun.Finish({"a", "measured"}, second);
  }
  {
    RunRecord finished(folder_.path());
    ASSERT_EQ(finished.Find("a", "measured")->files.size(), 1u);
    EXPECT_EQ(finished.Find("a", "measured")->files[0].sample, "bb");
    EXPECT_EQ(finished.Find("a", "measured")->earlier.size(), 1u);
    finished.Compact();
  }
  EXPECT_TRUE(RunRecord(folder_.path()).Find("a", "measured")->earlier.empty());
}

TEST_F(RunRecordTest, DamagedFileSaysHowToGoOn) {
  for (const std::string damaged :
       {"", "{\"version\":", "[]", "5", "{}", R"({"options": {}, "options_hash": "", "images": {"a": 5}})",
        R"({"options": {"a": 5}, "options_hash": "", "images": {}})"}) {
    test_support::WriteBytes(Json(), damaged);
    const std::string message = test_support::InputErrorOf([&] { RunRecord record(folder_.path()); });
    EXPECT_THAT(message, HasSubstr(Json().string())) << damaged;
    EXPECT_THAT(message, HasSubstr("--overwrite true")) << damaged;
  }
  std::filesystem::remove(Json());
  std::filesystem::create_directory(Json());
  EXPECT_THAT(test_support::InputErrorOf([&] { RunRecord record(folder_.path()); }), HasSubstr("is damaged"));
}

}  // namespace
}  // namespace colmap_ext

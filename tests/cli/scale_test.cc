// scripts/scale, small: what it times still runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using ::testing::HasSubstr;

TEST(ScaleScript, TimesPlanShardStatusAndFusionOfAFewImages) {
  const test_support::TemporaryFolder folder;
  const auto result =
      test_support::RunProgram({PHIMVS_SOURCE_DIR "/scripts/scale", PHIMVS_BINARY, "--images", "16",
                                "--finish", "--fuse", "--json", (folder / "rows.json").string()});
  ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  const std::string rows = test_support::ReadBytes(folder / "rows.json");
  for (const char* row : {"plan of all images", "start of shard 4/8", "the same, sources from model", "finished run found finished", "status",
                          "fusion of a slab", "fusion of a part of 16 of it"}) {
    EXPECT_THAT(rows, HasSubstr(std::string("\"what\": \"") + row + "\""));
  }
}

}  // namespace

// An estimation does no more work than it did: counts of it stand in work_counts.txt, each with a note that says why it is what it
// is, and may grow by 3 %. Unlike seconds they are the same on every machine.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>

#include "tests/support/run_program.h"

namespace {

namespace fs = std::filesystem;
using test_support::ProgramResult;
using test_support::RunProgram;

constexpr double kMayGrow = 0.03;

struct Expected {
  double count = 0;
  std::string note;
};

std::map<std::string, Expected> ReadExpected() {
  std::map<std::string, Expected> counts;
  std::ifstream file(fs::path(PHIMVS_SOURCE_DIR) / "tests/phi/work_counts.txt");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    std::string name;
    Expected expected;
    words >> name >> expected.count >> std::ws;
    std::getline(words, expected.note);
    counts[name] = expected;
  }
  return counts;
}

void ExpectNoMore(const std::string& name, double count) {
  const std::map<std::string, Expected> all = ReadExpected();
  const auto found = all.find(name);
  ASSERT_NE(found, all.end()) << "tests/phi/work_counts.txt has no line for " << name << ", now " << std::int64_t(count);
  const Expected& expected = found->second;
  EXPECT_FALSE(expected.note.empty()) << name << " has no note that says why it is what it is";
  EXPECT_LE(count, expected.count * (1 + kMayGrow))
      << name << " grew by " << 100 * (count / expected.count - 1)
      << " %. Where it must, write the new count and why into tests/phi/work_counts.txt";
  if (count < expected.count * (1 - kMayGrow))
    std::printf("%s fell to %.0f: write it into tests/phi/work_counts.txt, so that it stays\n", name.c_str(), count);
}

TEST(WorkCounts, HypothesesWindowsSamplesAndBytes) {
  const ProgramResult run = RunProgram({PHIMVS_WORK_COUNTS, "256", "192", "6"});
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  std::istringstream lines(run.output);
  int num_counts = 0;
  std::string name;
  for (double count = 0; lines >> name >> count; ++num_counts) {
    std::printf("%s %.0f\n", name.c_str(), count);
    ExpectNoMore(name, count);
  }
  EXPECT_EQ(num_counts, 4);
}

// They depend on the compiler, and on its options: of a release build alone.
TEST(WorkCounts, Instructions) {
#if !defined(NDEBUG) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "no release build";
#endif
  if (!test_support::HasProgram("valgrind")) GTEST_SKIP() << "valgrind is not installed";
  const std::string name = "instructions_of_g++" + std::to_string(__GNUC__) + "." + std::to_string(__GNUC_MINOR__);
  if (!ReadExpected().contains(name)) GTEST_SKIP() << "work_counts.txt has no line for this compiler, " << name;
  const ProgramResult run =
      RunProgram({"valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--toggle-collect=phi::EstimateOnCpu*",
                  PHIMVS_WORK_COUNTS, "56", "42", "3"});
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  std::smatch collected;
  ASSERT_TRUE(std::regex_search(run.errors, collected, std::regex(R"(Collected : (\d+))"))) << run.errors;
  std::printf("%s %s\n", name.c_str(), collected[1].str().c_str());
  ExpectNoMore(name, std::stod(collected[1]));
}

}  // namespace

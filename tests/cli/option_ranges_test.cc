// Whole numbers beyond any sense are refused, whatever the option: none may overflow further in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "colmap_ext/cli/fusion_options.h"
#include "colmap_ext/cli/stereo_options.h"
#include "phi/base/error.h"
#include "tests/support/error_message.h"
#include "tests/support/log_capture.h"

namespace colmap_ext {
namespace {

using test_support::MessageOf;
using testing::HasSubstr;

constexpr char kLargest[] = "2147483647", kLeast[] = "-2147483648";

// Throws what the command would throw for this option.
using Command = std::function<void(const std::string& option, const std::string& value)>;

void Stereo(const std::string& option, const std::string& value) {
  OptionParser parser("patch_match_stereo", "test");
  StereoCommandOptions options;
  options.Register(&parser);
  const std::string name = "--" + option;
  const char* arguments[] = {"phimvs", "--workspace_path", "w", name.c_str(), value.c_str()};
  parser.Parse(5, arguments);
  options.Finish(parser);
}

void Fusion(const std::string& option, const std::string& value) {
  OptionParser parser("stereo_fusion", "test");
  FusionCommandOptions options;
  options.Register(&parser);
  const std::string name = "--" + option;
  const char* arguments[] = {"phimvs", "--workspace_path", "w", name.c_str(), value.c_str()};
  parser.Parse(5, arguments);
  options.Finish(parser);
}

template <typename Options>
std::vector<std::string> Names() {
  OptionParser parser("test", "test");
  Options options;
  options.Register(&parser);
  std::vector<std::string> names;
  for (const auto& [name, value] : parser.EffectiveValues()) {
    if (name != "workspace_path") names.push_back(name);
  }
  return names;
}

// Those that any number is good for: larger than every image, more than every point has, a seed, a level.
const std::set<std::string> kUnbounded = {"PatchMatchStereo.max_image_size", "StereoFusion.max_image_size",
                                          "StereoFusion.max_num_pixels", "default_random_seed", "log_level"};

void ExpectRanges(const std::vector<std::string>& names, const Command& command) {
  const test_support::LogCapture log;
  int num_whole = 0;
  for (const std::string& name : names) {
    const std::string rule = MessageOf<phi::Error>([&] { command(name, "1.5"); });
    if (rule.find("whole number") == std::string::npos) continue;
    ++num_whole;
    if (!kUnbounded.contains(name)) {
      EXPECT_THROW(command(name, kLargest), phi::UsageError) << name;
    }
    if (name != "log_level") {
      EXPECT_THROW(command(name, kLeast), phi::UsageError) << name;
    }
  }
  EXPECT_GT(num_whole, 5);
}

TEST(OptionRanges, OfTheStereo) { ExpectRanges(Names<StereoCommandOptions>(), Stereo); }

TEST(OptionRanges, OfFusion) {
  ExpectRanges(Names<FusionCommandOptions>(), Fusion);
  // Twice this is 0 in 32 bits.
  for (const char* value : {"1073741824", "2147483647", "129", "0"}) {
    EXPECT_THAT(MessageOf<phi::UsageError>([&] { Fusion("StereoFusion.check_num_images", value); }),
                HasSubstr("between 1 and 128"))
        << value;
  }
  EXPECT_NO_THROW(Fusion("StereoFusion.check_num_images", "128"));
}

TEST(OptionRanges, OfThreads) {
  for (const char* threads : {"-1", "0", "1", "1024"})
    EXPECT_NO_THROW(Fusion("StereoFusion.num_threads", threads)) << threads;
  for (const char* threads : {"-2", "1025"})
    EXPECT_THROW(Fusion("StereoFusion.num_threads", threads), phi::UsageError) << threads;
}

}  // namespace
}  // namespace colmap_ext

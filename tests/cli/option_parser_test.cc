#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/cli/suggestion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "phi/base/error.h"
#include "phi/base/log.h"
#include "tests/support/error_message.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

enum class Speed { kSlow, kFast };

// A command with one option of each type, some of which COLMAP has too.
class OptionParserTest : public ::testing::Test {
 protected:
  void SetUp() override {
    parser_.Add("workspace_path", &path_, "Folder");
    parser_.Add("PatchMatchStereo.num_iterations", &iterations_, "Rounds").Unit("rounds").ColmapDefault("5");
    parser_.Add("PatchMatchStereo.filter", &filter_, "Filter").ColmapDefault("1");
    parser_.Add("StereoFusion.max_depth_error", &depth_error_, "Largest error").ColmapDefault("0.01");
    parser_.AddChoice<Speed>("PhiStereo.speed", &speed_, {{"slow", Speed::kSlow}, {"fast", Speed::kFast}},
                             "Speed");
    parser_.AddColmapOnly("PatchMatchStereo.sigma_color", "0.2", "there is no colour term");
    phi::SetLogSink([this](phi::LogLevel level, const std::string& message) {
      if (level == phi::LogLevel::kWarning) warnings_.push_back(message);
      log_ += message + "\n";
    });
  }
  void TearDown() override {
    phi::SetLogSink(nullptr);
    phi::SetLogLevel(phi::LogLevel::kInfo);
  }

  bool Parse(std::vector<std::string> arguments) {
    std::vector<const char*> argv = {"command"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    return parser_.Parse(static_cast<int>(argv.size()), argv.data());
  }
  std::string WriteIni(const std::string& text) {
    test_support::WriteBytes(folder_ / "project.ini", text);
    return (folder_ / "project.ini").string();
  }
  template <typename Error>
  std::string MessageOf(const std::vector<std::string>& arguments) {
    try {
      Parse(arguments);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  }

  test_support::TemporaryFolder folder_;
  OptionParser parser_{"command", "a command"};
  std::string path_ = "here";
  int iterations_ = 8, radius_ = 7;
  bool filter_ = true;
  double depth_error_ = 0.02;
  Speed speed_ = Speed::kSlow;
  std::vector<std::string> warnings_;
  std::string log_;
};

TEST_F(OptionParserTest, ReadsColmapsSpellings) {
  EXPECT_TRUE(
      Parse({"--workspace_path", "a b/ü", "--PatchMatchStereo.num_iterations=-3", "--PatchMatchStereo.filter",
             "false", "--StereoFusion.max_depth_error", "1e-3", "--PhiStereo.speed", "fast"}));
  EXPECT_EQ(path_, "a b/ü");
  EXPECT_EQ(iterations_, -3);
  EXPECT_FALSE(filter_);
  EXPECT_DOUBLE_EQ(depth_error_, 1e-3);
  EXPECT_EQ(speed_, Speed::kFast);
  EXPECT_THAT(warnings_, IsEmpty());
}

// Those that COLMAP takes: Python writes True.
TEST_F(OptionParserTest, BooleansAreColmaps) {
  for (const auto& [text, value] : {std::pair{"true", true}, {"1", true}, {"True", true}, {"YES", true}, {"on", true},
                                    {"false", false}, {"0", false}, {"False", false}, {"no", false}, {"Off", false}}) {
    filter_ = !value;
    EXPECT_EQ(MessageOf<phi::UsageError>({"--PatchMatchStereo.filter", text}), "no error") << text;
    EXPECT_EQ(filter_, value) << text;
  }
  EXPECT_THAT(MessageOf<phi::UsageError>({"--PatchMatchStereo.filter", "y"}), HasSubstr("'y'"));
}

// As COLMAP's --input_type and --output_type.
TEST_F(OptionParserTest, ChoicesMayHaveCapitals) {
  EXPECT_EQ(MessageOf<phi::UsageError>({"--PhiStereo.speed", "Fast"}), "no error");
  EXPECT_EQ(speed_, Speed::kFast);
  EXPECT_EQ(parser_.EffectiveValues().at("PhiStereo.speed"), "fast");
}

TEST_F(OptionParserTest, TheSeedGoesByItsFormerNameToo) {
  Parse({"--random_seed", "7"});
  EXPECT_EQ(parser_.random_seed(), 7u);
  EXPECT_THAT(warnings_, IsEmpty());
  Parse({"--project_path", WriteIni("random_seed=8\n")});
  EXPECT_EQ(parser_.random_seed(), 8u);
  Parse({"--project_path", WriteIni("random_seed=8\n"), "--default_random_seed", "9"});
  EXPECT_EQ(parser_.random_seed(), 9u);
  EXPECT_EQ(MessageOf<phi::UsageError>({"--random_seed", "7", "--default_random_seed", "9"}),
            "--random_seed and --default_random_seed are the same option; leave one of them out");
}

TEST_F(OptionParserTest, BadValuesNameOptionValueAndRule) {
  EXPECT_EQ(MessageOf<phi::UsageError>({"--PatchMatchStereo.num_iterations", "7x"}),
            "--PatchMatchStereo.num_iterations is '7x', but must be a whole number");
  EXPECT_EQ(MessageOf<phi::UsageError>({"--StereoFusion.max_depth_error", "nan"}),
            "--StereoFusion.max_depth_error is 'nan', but must be a number");
  EXPECT_EQ(MessageOf<phi::UsageError>({"--PhiStereo.speed", "warp"}),
            "--PhiStereo.speed is 'warp', but must be one of slow, fast");
  EXPECT_EQ(MessageOf<phi::UsageError>({"--default_random_seed", "-1"}),
            "--default_random_seed is '-1', but must be a whole number from 0 to 4294967295");
}

TEST(SuggestName, NamesAllThatAreMeantWithoutTheirGroup) {
  const std::vector<std::string> names = {"A.max_size", "B.max_sizes", "Beta.max_size"};
  EXPECT_EQ(SuggestName("max_size", names, "--"), " (did you mean --A.max_size or --Beta.max_size?)");
  EXPECT_EQ(SuggestName("max_siz", names, "--"), " (did you mean --A.max_size?)");
  EXPECT_EQ(SuggestName("colour", names, "--"), "");
}

TEST_F(OptionParserTest, UnknownAndRepeatedOptionsAreUsageErrors) {
  EXPECT_THAT(MessageOf<phi::UsageError>({"--PatchMatchStereo.iterations", "7"}), HasSubstr("iterations"));
  EXPECT_THAT(MessageOf<phi::UsageError>({"stray"}), HasSubstr("--help"));
  for (const char* misspelt :
       {"--PatchMatchStereo.num_iterasions", "--PatchMatchStereo.numiterations", "--num_iterations",
        "--patchmatchstereo.num_iterations", "--PhiStereo.num_iterations"}) {
    EXPECT_THAT(MessageOf<phi::UsageError>({misspelt, "7"}),
                HasSubstr("(did you mean --PatchMatchStereo.num_iterations?)"));
  }
  EXPECT_EQ(MessageOf<phi::UsageError>({"-workspace_path", "a"}),
            "there is no option '-workspace_path' (did you mean --workspace_path?); see `phimvs command --help`");
  EXPECT_EQ(MessageOf<phi::UsageError>({"--colour", "7"}), "there is no option '--colour'; see `phimvs command --help`");
  EXPECT_THAT(MessageOf<phi::UsageError>({"--colour", "7"}), ::testing::Not(HasSubstr("did you mean")));
  EXPECT_THAT(MessageOf<phi::UsageError>({"--workspace_path", "a", "--workspace_path", "b"}),
              HasSubstr("workspace_path"));
  EXPECT_THAT(MessageOf<phi::UsageError>({"--workspace_path"}), HasSubstr("workspace_path"));
}

// In words of our own: those of Boost never end for the last of these.
TEST_F(OptionParserTest, CommandLinesThatCannotBeReadSayWhy) {
  const std::string see = "; see `phimvs command --help`";
  EXPECT_EQ(MessageOf<phi::UsageError>({"--workspace_path"}), "--workspace_path needs a value" + see);
  EXPECT_EQ(MessageOf<phi::UsageError>({"--workspace_path="}), "--workspace_path needs a value" + see);
  EXPECT_EQ(MessageOf<phi::UsageError>({"--workspace_path", "a", "--workspace_path", "b"}),
            "--workspace_path is given more than once" + see);
  EXPECT_EQ(MessageOf<phi::UsageError>({"--help=5"}), "--help takes no value" + see);
  EXPECT_EQ(MessageOf<phi::UsageError>({"--PatchMatchStereo"}),
            "--PatchMatchStereo may be --PatchMatchStereo.num_iterations or --PatchMatchStereo.filter or "
            "--PatchMatchStereo.sigma_color" + see);
  EXPECT_EQ(MessageOf<phi::UsageError>({"--%canonical_option%="}), "--%canonical_option% needs a value" + see);
}

TEST_F(OptionParserTest, CommandLineGoesBeforeIniBeforeDefault) {
  const std::string ini =
      WriteIni("workspace_path=there\n[PatchMatchStereo]\nnum_iterations=11\nfilter=false\n");
  Parse({"--project_path", ini, "--PatchMatchStereo.num_iterations", "12"});
  EXPECT_EQ(iterations_, 12);
  EXPECT_EQ(path_, "there");
  EXPECT_FALSE(filter_);
  EXPECT_DOUBLE_EQ(depth_error_, 0.02);
  EXPECT_TRUE(parser_.IsSet("PatchMatchStereo.filter"));
  EXPECT_FALSE(parser_.IsSet("StereoFusion.max_depth_error"));
}

TEST_F(OptionParserTest, UnknownIniKeysWarnOnceAndBadIniValuesNameTheFile) {
  const std::string ini = WriteIni("[SiftExtraction]\nmax_num_features=8192\npeak=1\n");
  Parse({"--project_path", ini});
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_THAT(warnings_[0], HasSubstr("SiftExtraction.max_num_features, SiftExtraction.peak"));
  EXPECT_THAT(warnings_[0], HasSubstr(ini));
  const std::string bad = WriteIni("[PatchMatchStereo]\nnum_iterations=many\n");
  EXPECT_THAT(MessageOf<phi::InputError>({"--project_path", bad}), HasSubstr("project.ini"));
  EXPECT_EQ(test_support::WholeMessageOf<phi::InputError>([&] { Parse({"--project_path", bad}); }).file, bad);
}

TEST_F(OptionParserTest, ErrorsOfAProjectFileNameTheLine) {
  const std::string path = (folder_ / "project.ini").string();
  const std::string no_entry = "neither a [group], nor NAME=VALUE, nor a comment (#)";
  for (const auto& [text, line] : {std::pair{"# first\n\n[broken\n", 3}, {"workspace_path=x\r\n=y\r\n", 2}, {"word", 1}}) {
    EXPECT_EQ(MessageOf<phi::InputError>({"--project_path", WriteIni(text)}),
              "--project_path: " + path + ": line " + std::to_string(line) + ": " + no_entry);
  }
  const std::string group = "# first\n[PatchMatchStereo]\n\n";
  EXPECT_EQ(MessageOf<phi::InputError>({"--project_path", WriteIni(group + "num_iterations = many # a lot\n")}),
            path + ": line 4: --PatchMatchStereo.num_iterations is 'many', but must be a whole number");
  parser_.Add("PatchMatchStereo.window_radius", &radius_, "Window").Between(1, 32);
  EXPECT_EQ(MessageOf<phi::InputError>({"--project_path", WriteIni(group + "window_radius=0\n")}),
            path + ": line 4: --PatchMatchStereo.window_radius is 0, but must be between 1 and 32");
  EXPECT_EQ(MessageOf<phi::UsageError>({"--project_path", WriteIni(group + "window_radius=0\n"),
                                        "--PatchMatchStereo.window_radius", "33"}),
            "--PatchMatchStereo.window_radius is 33, but must be between 1 and 32");
}

// As in COLMAP. The last one won in silence.
TEST_F(OptionParserTest, AProjectFileThatSetsAnOptionTwiceIsRefused) {
  const std::string path = (folder_ / "project.ini").string();
  EXPECT_EQ(MessageOf<phi::InputError>({"--project_path", WriteIni("random_seed=3\n\ndefault_random_seed=4\n")}),
            path + ": line 3: default_random_seed is the option of line 1 again; leave one of them out");
  const std::string group = "[PatchMatchStereo]\nnum_iterations=4\n";
  EXPECT_EQ(MessageOf<phi::InputError>({"--project_path", WriteIni(group + "[StereoFusion]\n" + group)}),
            path + ": line 5: PatchMatchStereo.num_iterations is the option of line 2 again; leave one of them out");
  EXPECT_EQ(MessageOf<phi::InputError>({"--project_path", WriteIni("[A]\nsize=1\n[B]\nsize=2\n")}), "no error");
}

TEST_F(OptionParserTest, AProjectFileMayBeginWithAByteOrderMark) {
  Parse({"--project_path", WriteIni("\xEF\xBB\xBF[ PatchMatchStereo ] # of an editor\nnum_iterations = 4\n[]\nworkspace_path=w\n")});
  EXPECT_EQ(iterations_, 4);
  EXPECT_EQ(path_, "w");
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(OptionParserTest, ColmapsDefaultsInAFileOfColmapsCountAsUnset) {
  // COLMAP writes all its options, single precision ones with 17 digits.
  const std::string ini = WriteIni(
      "[PatchMatchStereo]\nnum_iterations=5\nfilter=false\nsigma_color=0.20000000298023224\n[StereoFusion]\n"
      "max_depth_error=0.0099999997764825821\n");
  Parse({"--project_path", ini});
  EXPECT_EQ(iterations_, 8);  // COLMAP's default: nobody chose it
  EXPECT_FALSE(filter_);      // not COLMAP's default
  EXPECT_DOUBLE_EQ(depth_error_, 0.02);
  EXPECT_THAT(warnings_, IsEmpty());  // sigma_color has COLMAP's default
  EXPECT_THAT(log_,
              HasSubstr("taken as unset: PatchMatchStereo.num_iterations, StereoFusion.max_depth_error"));
}

TEST_F(OptionParserTest, ValuesInAFileOfTheUsersCountEvenIfColmapHasThem) {
  Parse({"--project_path", WriteIni("[PatchMatchStereo]\nnum_iterations=5\n")});
  EXPECT_EQ(iterations_, 5);
}

TEST_F(OptionParserTest, ColmapsDefaultsOnTheCommandLineCount) {
  Parse({"--PatchMatchStereo.num_iterations", "5", "--PatchMatchStereo.sigma_color", "0.2"});
  EXPECT_EQ(iterations_, 5);
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_EQ(warnings_[0], "--PatchMatchStereo.sigma_color has no effect: there is no colour term");
}

// Of COLMAP 3 and of what came after it.
TEST_F(OptionParserTest, ColmapsOptionsOfTheLogAreTaken) {
  Parse({"--project_path", WriteIni("log_target=stderr_and_file\nlog_path=\nlog_level=0\nlog_severity=0\nlog_color=true\n")});
  EXPECT_THAT(warnings_, IsEmpty());
  Parse({"--log_to_stderr", "1", "--log_target", "file", "--log_path", "logs", "--log_severity", "1", "--log_color", "0"});
  EXPECT_EQ(warnings_.size(), 5u);
}

TEST_F(OptionParserTest, LogsWhatDiffersFromTheDefaults) {
  Parse({"--PhiStereo.speed", "fast", "--PatchMatchStereo.num_iterations", "8"});
  EXPECT_EQ(log_, "options: --PhiStereo.speed fast\n");
}

TEST_F(OptionParserTest, LogsAllValuesAtLevel3) {
  Parse({"--log_level", "3", "--PhiStereo.speed", "fast", "--default_random_seed", "4000000000"});
  EXPECT_THAT(log_, HasSubstr("options PatchMatchStereo: filter=true num_iterations=8"));
  EXPECT_THAT(log_, HasSubstr("options PhiStereo: speed=fast"));
  EXPECT_EQ(parser_.random_seed(), 4000000000u);
  EXPECT_EQ(parser_.EffectiveValues().at("default_random_seed"), "4000000000");
}

TEST_F(OptionParserTest, LogLevelSilences) {
  Parse({"--log_level", "0", "--PatchMatchStereo.sigma_color", "0.2"});
  EXPECT_EQ(log_, "");
}

TEST_F(OptionParserTest, HelpShowsDefaultsAndUnitsAndRunsNothing) {
  parser_.Add("needed", &path_, "Must be there").Required();
  ::testing::internal::CaptureStdout();
  EXPECT_FALSE(Parse({"-h"}));
  const std::string help = ::testing::internal::GetCapturedStdout();
  EXPECT_THAT(help, HasSubstr("--PatchMatchStereo.num_iterations arg (=8)"));
  EXPECT_THAT(help, HasSubstr("Rounds [rounds]"));
  EXPECT_THAT(help, HasSubstr("(required)"));
  EXPECT_THAT(help, HasSubstr("{slow, fast}"));
  EXPECT_EQ(MessageOf<phi::UsageError>({}), "--needed is required; see `phimvs command --help`");
}

}  // namespace
}  // namespace colmap_ext

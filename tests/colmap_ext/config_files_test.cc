// stereo/patch-match.cfg and stereo/fusion.cfg.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "colmap_ext/fusion_config.h"
#include "colmap_ext/patch_match_config.h"
#include "tests/support/error_message.h"
#include "tests/support/small_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::InputErrorOf;
using test_support::ReadBytes;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// Images of the workspace: 0 = a.png, 1 = sub folder/b é.png, 2 = c.png.
class ConfigFilesTest : public ::testing::Test {
 protected:
  ConfigFilesTest() {
    test_support::WriteSmallWorkspace(folder_.path());
    workspace_.emplace(WorkspaceOptions{folder_.path()});
  }
  std::vector<PatchMatchProblem> ReadProblems(const std::string& text) {
    WriteBytes(folder_ / "stereo/patch-match.cfg", text);
    return ReadPatchMatchConfig(*workspace_);
  }
  std::string ProblemsError(const std::string& text) {
    return InputErrorOf([&] { ReadProblems(text); });
  }

  TemporaryFolder folder_;
  std::optional<Workspace> workspace_;
};

TEST_F(ConfigFilesTest, PatchMatchConfigHasTheExactBytes) {
  WritePatchMatchConfig(folder_ / "x.cfg", {"a.png", "sub folder/b.png"}, 20);
  EXPECT_EQ(ReadBytes(folder_ / "x.cfg"), "a.png\n__auto__, 20\nsub folder/b.png\n__auto__, 20\n");
  WriteFusionConfig(folder_ / "y.cfg", {"a.png", "sub folder/b.png"});
  EXPECT_EQ(ReadBytes(folder_ / "y.cfg"), "a.png\nsub folder/b.png\n");
}

TEST_F(ConfigFilesTest, ReadsAutomaticAllAndExplicitSources) {
  const auto problems = ReadProblems(
      "# a comment\n"
      "c.png\n"
      "__auto__, 20\n"
      "\n"
      "  a.png \r\n"
      "# another\n"
      "__all__\n"
      "sub folder/b \xC3\xA9.png\n"
      "c.png,  a.png,\n");
  ASSERT_EQ(problems.size(), 3u);
  EXPECT_EQ(problems[0].reference, 2);
  EXPECT_EQ(problems[0].max_automatic_sources, 20);
  EXPECT_THAT(problems[0].sources, IsEmpty());
  EXPECT_EQ(problems[1].reference, 0);
  EXPECT_EQ(problems[1].max_automatic_sources, 0);
  EXPECT_THAT(problems[1].sources, ElementsAre(1, 2));
  EXPECT_EQ(problems[2].reference, 1);
  EXPECT_EQ(problems[2].max_automatic_sources, 0);
  EXPECT_THAT(problems[2].sources, ElementsAre(2, 0));
}

TEST_F(ConfigFilesTest, ToleratesSpacingVariantsByteOrderMarkAndMissingLineEnd) {
  EXPECT_EQ(ReadProblems("\xEF\xBB\xBF"
                         "a.png\n__auto__,5")[0]
                .max_automatic_sources,
            5);
  EXPECT_EQ(ReadProblems("a.png\n __auto__ ,  7 \n")[0].max_automatic_sources, 7);
  EXPECT_THAT(ReadProblems("a.png\nc.png;sub folder/b \xC3\xA9.png")[0].sources, ElementsAre(2, 1));
}

TEST_F(ConfigFilesTest, ReadsTheFileThatConfigPathNames) {
  WriteBytes(folder_ / "other.cfg", "c.png\n__all__\n");
  const auto problems = ReadPatchMatchConfig(*workspace_, folder_ / "other.cfg");
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0].reference, 2);
  EXPECT_THAT(InputErrorOf([&] { ReadPatchMatchConfig(*workspace_, folder_ / "none.cfg"); }),
              HasSubstr("none.cfg"));
}

TEST_F(ConfigFilesTest, SaysWhatIsWrongAndOnWhichLine) {
  const std::string file = (folder_ / "stereo/patch-match.cfg").string();
  const std::pair<const char*, const char*> cases[] = {
      {"# c\nd.png\n__all__\n", "line 2: reference image 'd.png' is not in the sparse model"},
      {"a.png\nc.png, d.png\n", "line 2: source image 'd.png' is not in the sparse model"},
      {"a.png\n__all__\nc.png\n", "line 3: no line of source images follows reference image 'c.png'"},
      {"a.png\n__all__\na.png\n__all__\n", "line 3: reference image 'a.png' is already on line 1"},
      {"__auto__, 20\na.png\n", "line 1: the name of a reference image is expected"},
      {"a.png\n__auto__\n", "line 2: '__auto__' must be __auto__, N"},
      {"a.png\n__auto__, 0\n", "line 2: '__auto__, 0' must be __auto__, N"},
      {"a.png\n__auto__, many\n", "line 2: '__auto__, many' must be"},
      {"a.png\n__auto__, 99999999999\n", "line 2: '__auto__, 99999999999' must be"},
      {"a.png\na.png, c.png\n", "line 2: image 'a.png' is a source of itself"},
      {"a.png\n, ;\n", "line 2: ', ;' names no source image"},
      {"a.png\nc.png, c.png\n", "line 2: source image 'c.png' is named twice"},
  };
  for (const auto& [text, message] : cases)
    EXPECT_THAT(ProblemsError(text), StartsWith(file + ": " + message));
  EXPECT_THAT(ProblemsError("# nothing\n"), AllOf(HasSubstr(file), HasSubstr("names no reference image")));
  fs::remove(file);
  EXPECT_THAT(InputErrorOf([&] { ReadPatchMatchConfig(*workspace_); }),
              AllOf(HasSubstr(file), HasSubstr("missing")));
}

TEST_F(ConfigFilesTest, ListsAllProblemsOnRequest) {
  WriteBytes(folder_ / "stereo/patch-match.cfg",
             "d.png\n__all__\na.png\ne.png, c.png, f.png\nc.png\n__auto__\n");
  ProblemList problems;
  const auto read = ReadPatchMatchConfig(*workspace_, {}, &problems);
  EXPECT_THAT(problems,
              ElementsAre(HasSubstr("d.png"), HasSubstr("e.png"), HasSubstr("f.png"), HasSubstr("__auto__")));
  ASSERT_EQ(read.size(), 1u);
  EXPECT_THAT(read[0].sources, ElementsAre(2));
}

TEST_F(ConfigFilesTest, ReadsFusionConfig) {
  const fs::path path = folder_ / "stereo/fusion.cfg";
  EXPECT_THAT(ReadFusionConfig(*workspace_), ElementsAre(0, 1, 2));
  WriteBytes(path, "# comment\nc.png\n\na.png\n");
  EXPECT_THAT(ReadFusionConfig(*workspace_), ElementsAre(2, 0));
  WriteBytes(path, "c.png\nx.png\nc.png\n");
  EXPECT_THAT(InputErrorOf([&] { ReadFusionConfig(*workspace_); }),
              StartsWith(path.string() + ": line 2: image 'x.png'"));
  ProblemList problems;
  EXPECT_THAT(ReadFusionConfig(*workspace_, path, &problems), ElementsAre(2));
  EXPECT_THAT(problems, ElementsAre(HasSubstr("line 2"), HasSubstr("line 3: image 'c.png' is named twice")));
  WriteBytes(path, "");
  EXPECT_THAT(InputErrorOf([&] { ReadFusionConfig(*workspace_); }), HasSubstr("names no image"));
}

}  // namespace
}  // namespace colmap_ext

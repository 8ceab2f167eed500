#include "colmap_ext/failure_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace colmap_ext {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

phi::Message About(const std::string& image, const std::string& stage, const std::string& text) {
  return WithContext(text, phi::AboutImage(image) + phi::AboutStage(stage));
}

phi::Message Missing(const std::string& image) {
  return About(image, "photometric", "image " + image + ": the file /w 1/images/" + image + " is missing");
}

std::string Name(int number) { return "cam" + std::to_string(number % 3) + "/" + std::to_string(number) + ".jpg"; }

TEST(FailureText, NamesImageAndStageOnce) {
  EXPECT_EQ(DescribeFailure(Missing("a.jpg")), "a.jpg (photometric): the file /w 1/images/a.jpg is missing");
  EXPECT_EQ(DescribeFailure(About("a.jpg", "", "/w/images/a.jpg is cut short")), "a.jpg: /w/images/a.jpg is cut short");
  EXPECT_EQ(DescribeFailure(About("a", "x", "image ab: is none")), "a (x): image ab: is none");
}

TEST(FailureText, ImagesOfOneReasonAreOneLineInWhateverOrderTheyCome) {
  std::vector<phi::Message> messages = {About("z.jpg", "measured", "this needs 12.5 GB, the card has 8"), Missing("cam0/7.jpg"),
                                        About("y.jpg", "measured", "this needs 9 GB, the card has 8"), Missing("cam1/12.jpg"),
                                        About("x.jpg", "geometric", "this needs 9 GB, the card has 8"), Missing("cam0/8.jpg")};
  for (int i = 0; i < 6; ++i) {
    std::rotate(messages.begin(), messages.begin() + 1, messages.end());
    EXPECT_THAT(LinesByReason(messages),
                ElementsAre("cam0/7.jpg, cam0/8.jpg, cam1/12.jpg (photometric): the file /w 1/images/cam0/7.jpg is missing",
                            "y.jpg, z.jpg (measured): this needs 9 GB, the card has 8",
                            "x.jpg (geometric): this needs 9 GB, the card has 8"));
  }
}

// As of a source image that several images name.
TEST(FailureText, NumbersOfAnotherFileAreAnotherReason) {
  EXPECT_THAT(LinesByReason({About("a.jpg", "", "left out: /w/2.jpg: is cut"), About("b.jpg", "", "left out: /w/3.jpg: is cut"),
                             About("c.jpg", "", "left out: /w/2.jpg: is cut")}),
              ElementsAre("a.jpg, c.jpg: left out: /w/2.jpg: is cut", "b.jpg: left out: /w/3.jpg: is cut"));
}

TEST(FailureText, IsShortHoweverManyImagesFail) {
  std::vector<phi::Message> messages;
  for (int i = 0; i < 10000; ++i) messages.push_back(Missing(Name(i)));
  EXPECT_THAT(LinesByReason(messages),
              ElementsAre("cam0/0.jpg, cam0/1002.jpg, cam0/1005.jpg, cam0/1008.jpg, cam0/1011.jpg and 9995 more (photometric): the file "
                          "/w 1/images/cam0/0.jpg is missing"));
  for (int i = 0; i < 10000; ++i) messages.push_back(About(Name(i), "measured", "/masks/" + std::to_string(i) + "x.png is no mask"));
  const std::vector<std::string> lines = LinesByReason(messages);
  ASSERT_THAT(lines, SizeIs(11));
  EXPECT_THAT(lines.front(), testing::HasSubstr(" and 9995 more (photometric)"));
  EXPECT_EQ(lines.back(), "9991 more, for 9991 other reasons");
}

TEST(FailureText, ListsBelowTheHeading) {
  EXPECT_EQ(ListByReason("2 of 9 images failed:", {Missing("b.jpg"), About("a.jpg", "x", "is too dark")}),
            "2 of 9 images failed:\n  a.jpg (x): is too dark\n  b.jpg (photometric): the file /w 1/images/b.jpg is missing");
  EXPECT_EQ(ListByReason("none:", {}), "none:");
}

}  // namespace
}  // namespace colmap_ext

// Options as lists: text to value and back, ranges, keys.
#include "phi/base/option.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace phi {
namespace {

enum class Color { kRed, kGreen };

struct Sample {
  bool flag = true;
  int count = 3;
  double share = 0.5;
  std::string name = "n";
  std::filesystem::path folder;
  Color color = Color::kGreen;

  OptionList List() {
    OptionList list;
    list.Add("flag", &flag, "A flag");
    list.Add("Group.count", &count, "A count").Unit("views").Between(1, 8);
    list.Add("share", &share, "A share").MoreThan(0).LessThan(1);
    list.Add("name", &name, "A name").NotInKey("for the log");
    list.Add("folder", &folder, "A folder");
    list.AddChoice<Color>("color", &color, {{"red", Color::kRed}, {"green", Color::kGreen}}, "A colour");
    return list;
  }
};

std::string Rule(Option* option, const std::string& text) {
  try {
    option->Assign(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(OptionList, AssignsWhatTextReadsBack) {
  Sample sample;
  OptionList list = sample.List();
  const std::pair<const char*, const char*> values[] = {{"flag", "false"}, {"Group.count", "7"}, {"share", "0.1"},
                                                        {"name", "a b"},   {"folder", "/x/y"},   {"color", "red"}};
  for (const auto& [name, text] : values) {
    list.Find(name)->Assign(text);
    EXPECT_EQ(list.Find(name)->Text(), text);
  }
  EXPECT_FALSE(sample.flag);
  EXPECT_EQ(sample.count, 7);
  EXPECT_EQ(sample.share, 0.1);
  EXPECT_EQ(sample.name, "a b");
  EXPECT_EQ(sample.folder, "/x/y");
  EXPECT_EQ(sample.color, Color::kRed);
  EXPECT_EQ(list.Find("share")->default_text(), "0.5");  // of when it was added
  EXPECT_EQ(list.Find("nothing"), nullptr);
}

TEST(OptionList, RefusesWhatIsNoValue) {
  Sample sample;
  OptionList list = sample.List();
  EXPECT_EQ(Rule(list.Find("flag"), "maybe"), "true, false, 1 or 0");
  EXPECT_EQ(Rule(list.Find("flag"), ""), "true, false, 1 or 0");
  EXPECT_EQ(Rule(list.Find("Group.count"), "7x"), "a whole number");
  EXPECT_EQ(Rule(list.Find("Group.count"), "99999999999"), "a whole number");
  EXPECT_EQ(Rule(list.Find("share"), "nan"), "a number");
  EXPECT_EQ(Rule(list.Find("color"), "blue"), "one of red, green");
  EXPECT_EQ(sample.count, 3);
}

TEST(OptionList, ChecksRanges) {
  Sample sample;
  for (const int count : {1, 8}) {
    sample.count = count;
    EXPECT_EQ(sample.List().Check(), "");
  }
  sample.count = 9;
  EXPECT_EQ(sample.List().Check(), "--Group.count is 9, but must be between 1 and 8 views");
  sample.count = 0;
  EXPECT_EQ(sample.List().Check(), "--Group.count is 0, but must be between 1 and 8 views");
  sample.count = 1;
  for (const double share : {0.0, 1.0}) {
    sample.share = share;
    EXPECT_EQ(sample.List().Check(), "--share is " + std::to_string(static_cast<int>(share)) + ", but must be in (0, 1)");
  }
  OptionList list;
  double angle = -1;
  Option& option = list.Add("angle", &angle, "").Unit("degrees").AtLeast(0);
  EXPECT_EQ(option.Check(), "--angle is -1, but must be at least 0 degrees");
  option.MoreThan(-1);
  EXPECT_EQ(option.Check(), "--angle is -1, but must be more than -1 degrees");
}

TEST(OptionList, KeysHoldWhatResultsFollowFrom) {
  Sample sample;
  const std::string before = sample.List().KeyText();
  EXPECT_EQ(before, " flag=true Group.count=3 share=0.5 folder= color=green");
  sample.name = "other";
  EXPECT_EQ(sample.List().KeyText(), before);
  sample.share = 0.5000000000000001;  // the next double
  EXPECT_NE(sample.List().KeyText(), before);
}

TEST(OptionList, ANameIsThereOnce) {
  Sample sample;
  OptionList list = sample.List(), other = sample.List();
  EXPECT_THROW(list.Append(sample.List()), std::logic_error);
  OptionList some;
  some.Append(std::move(other), {"name", "flag"});
  EXPECT_EQ(some.size(), 2u);
  EXPECT_THROW(some.Append(sample.List(), {"nothing"}), std::logic_error);
}

}  // namespace
}  // namespace phi

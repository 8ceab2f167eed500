#include "phi/base/rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>

#include "phi/options.h"

namespace phi {
namespace {

using testing::HasSubstr;

Rules Assigned(const std::string& text) {
  Rules rules;
  rules.Assign(text, RuleStage::kSourceViews, RuleStage::kInference);
  return rules;
}

std::string Complaint(const std::string& text) {
  try {
    Assigned(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Rules, AreAllAsTheyAre) {
  const Rules rules;
  for (std::size_t i = 0; i < kNumRules; ++i)
    EXPECT_EQ(rules.Factor(static_cast<Rule>(i)), 1) << kRules[i].name;
  EXPECT_EQ(rules.Text(RuleStage::kSourceViews, RuleStage::kFusion), "");
  EXPECT_EQ(rules.KeyText(RuleStage::kFilter), "");
}

TEST(Rules, AreOffOrScaled) {
  const Rules rules = Assigned("own_texture=0,depth_edges=0.7");
  EXPECT_FALSE(rules.IsOn(Rule::kOwnTexture));
  EXPECT_EQ(rules.Scale(Rule::kOwnTexture), 1);
  EXPECT_EQ(rules.Factor(Rule::kDepthEdges), 0.7f);
  EXPECT_EQ(rules.Scale(Rule::kDepthEdges), 0.7f);
  EXPECT_EQ(rules.Factor(Rule::kClues), 1);
  EXPECT_EQ(rules.Count(Rule::kDepthEdges, 3), 2);
  EXPECT_EQ(rules.Count(Rule::kOwnTexture, 3), 3);
}

TEST(Rules, ReadBackAsTheSameText) {
  const std::string text = "own_texture=0,depth_edges=0.7";
  EXPECT_EQ(Assigned("depth_edges=0.7,own_texture=0").Text(RuleStage::kSourceViews, RuleStage::kFusion), text);
  EXPECT_EQ(Assigned("own_texture=1").Text(RuleStage::kSourceViews, RuleStage::kFusion), "");
}

TEST(Rules, AStagesKeyHoldsItsOwn) {
  const Rules rules = Assigned("own_texture=0,depth_edges=0.7");
  EXPECT_EQ(rules.KeyText(RuleStage::kFilter), " rules=own_texture=0");
  EXPECT_EQ(rules.KeyText(RuleStage::kInference), " rules=depth_edges=0.7");
  EXPECT_EQ(rules.KeyText(RuleStage::kEstimation), "");
}

TEST(Rules, WhatIsNoSettingIsRefused) {
  for (const char* text :
       {"no_such=0", "own_texture", "own_texture=", "own_texture=-1", "own_texture=11", "own_texture=nan",
        "own_texture=0.7x", "cover=0", "overexposed=0.7", "even_regions=0", "own_texture=0,,"}) {
    EXPECT_THAT(Complaint(text), HasSubstr("own_texture")) << text;
  }
  EXPECT_THAT(Complaint("x=0"), testing::Not(HasSubstr("cloud_holes"))) << "fusion's";
}

TEST(Rules, ARefusedTextChangesNothing) {
  Rules rules = Assigned("own_texture=0");
  EXPECT_THROW(rules.Assign("depth_edges=0.7,no_such=0", RuleStage::kSourceViews, RuleStage::kInference),
               std::invalid_argument);
  EXPECT_EQ(rules.Text(RuleStage::kSourceViews, RuleStage::kFusion), "own_texture=0");
}

std::string Page() {
  std::ifstream file(PHIMVS_SOURCE_DIR "/docs/development/rules.md");
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Rules, AreThoseOfThePage) {
  const std::string page = Page();
  std::multiset<std::string> listed, names;
  const std::regex row(R"(\n\| `([a-z_]+)` \|)");
  for (std::sregex_iterator it(page.begin(), page.end(), row), end; it != end; ++it) listed.insert((*it)[1]);
  for (const RuleDescription& rule : kRules) names.insert(rule.name);
  EXPECT_EQ(listed, names);
  EXPECT_THAT(page, HasSubstr("\n" + std::to_string(kNumRules) + " rules;"));
}

// Their constants are sought where the page says.
TEST(Rules, NameFilesThatAreThere) {
  namespace fs = std::filesystem;
  std::set<std::string> there;
  for (const char* folder : {"phi", "colmap_ext"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(PHIMVS_SOURCE_DIR) / folder))
      there.insert(entry.path().filename().string());
  }
  const std::string page = Page();
  const std::regex row(R"(\n\| `[a-z_]+` \|[^\n]*)"), name(R"(`([a-z_]+\.(h|cc))`)");
  int num_names = 0;
  for (std::sregex_iterator it(page.begin(), page.end(), row), end; it != end; ++it) {
    const std::string text = it->str();
    for (std::sregex_iterator file(text.begin(), text.end(), name); file != end; ++file, ++num_names)
      EXPECT_TRUE(there.contains((*file)[1])) << text;
  }
  EXPECT_GE(num_names, static_cast<int>(kNumRules));
}

}  // namespace
}  // namespace phi

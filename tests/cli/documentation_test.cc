// The pages for users: short, in short sentences, with links that lead somewhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = PHIMVS_SOURCE_DIR;

std::vector<fs::path> Pages(const fs::path& folder) {
  std::vector<fs::path> pages;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  }
  std::sort(pages.begin(), pages.end());
  return pages;
}

std::vector<fs::path> UserPages() {
  std::vector<fs::path> pages = Pages(kRoot / "docs");
  pages.push_back(kRoot / "README.md");
  return pages;
}

std::size_t NumWords(const std::string& text) {
  std::istringstream words(text);
  std::size_t count = 0;
  for (std::string word; words >> word;) ++count;
  return count;
}

// Paragraphs and list items on one line each, without code blocks, tables, headings and the targets of links; `code` is one
// word.
std::vector<std::string> Paragraphs(const fs::path& page) {
  std::istringstream lines(test_support::ReadBytes(page));
  std::vector<std::string> paragraphs(1);
  bool in_code = false;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find_first_not_of(" >");
    if (line.starts_with("```")) in_code = !in_code;
    const bool is_text = begin != std::string::npos && !in_code && line.find_first_of("#|!`") != begin;
    const bool is_code_word = begin != std::string::npos && line[begin] == '`' && !line.starts_with("```");
    if (in_code || !(is_text || is_code_word) || line.starts_with("- ")) paragraphs.emplace_back();
    if (!in_code && (is_text || is_code_word)) paragraphs.back() += line + " ";
  }
  for (std::string& paragraph : paragraphs) {
    paragraph = std::regex_replace(paragraph, std::regex(R"(\]\([^)]*\))"), "]");
    paragraph = std::regex_replace(paragraph, std::regex("`[^`]*`"), "code");
  }
  return paragraphs;
}

std::vector<std::string> Sentences(const std::string& paragraph) {
  static const std::regex end(R"([.!?][*_)]*\s+)");
  std::vector<std::string> sentences(std::sregex_token_iterator(paragraph.begin(), paragraph.end(), end, -1),
                                     {});
  return sentences;
}

TEST(Documentation, UserPagesAreShort) {
  std::size_t num_words = 0;
  for (const fs::path& page : Pages(kRoot / "docs")) num_words += NumWords(test_support::ReadBytes(page));
  EXPECT_LE(num_words, 6000u);
}

TEST(Documentation, SentencesForUsersHaveThirtyWordsAtMost) {
  EXPECT_EQ(Sentences("One two. *Three.* Four? Five").size(), 4u);
  std::size_t num_sentences = 0;
  for (const fs::path& page : UserPages()) {
    for (const std::string& paragraph : Paragraphs(page)) {
      for (const std::string& sentence : Sentences(paragraph)) {
        ++num_sentences;
        EXPECT_LE(NumWords(sentence), 30u) << page << ": " << sentence;
      }
    }
  }
  EXPECT_GT(num_sentences, 200u);
}

TEST(Documentation, LinksLeadToFiles) {
  const std::regex link(R"(\]\(([^)#\s]+))");
  std::vector<fs::path> pages = UserPages();
  for (const char* folder : {"docs/development", "docs/development/notes"}) {
    for (const fs::path& page : Pages(kRoot / folder)) pages.push_back(page);
  }
  for (const fs::path& page : pages) {
    const std::string text = test_support::ReadBytes(page);
    for (std::sregex_iterator it(text.begin(), text.end(), link), none; it != none; ++it) {
      const std::string target = (*it)[1];
      if (target.find("://") != std::string::npos) continue;
      EXPECT_TRUE(fs::exists(page.parent_path() / target)) << page << ": " << target;
    }
  }
}

}  // namespace

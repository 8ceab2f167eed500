// Every branch between the robust and the paper's formulas is listed in docs/development/paper_mode.md, which says what the
// paper does there. Whoever adds a robust rule adds its branch, and so its line.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <string>

namespace {

namespace fs = std::filesystem;

std::string ReadText(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Without comments and strings.
std::string CodeOf(const fs::path& path) {
  const std::string no_strings = std::regex_replace(ReadText(path), std::regex(R"("(\\.|[^"\\\n])*")"), "");
  return std::regex_replace(no_strings, std::regex("//[^\n]*"), "");
}

int Count(const std::string& text, const std::regex& expression) {
  return static_cast<int>(
      std::distance(std::sregex_iterator(text.begin(), text.end(), expression), std::sregex_iterator()));
}

template <class Function>
void ForEachSource(const Function& function) {
  const fs::path root = PHIMVS_SOURCE_DIR;
  for (const char* folder : {"phi", "cuda", "colmap_ext"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string extension = entry.path().extension().string();
      const bool is_source =
          extension == ".h" || extension == ".cc" || extension == ".cu" || extension == ".cuh";
      if (is_source) function(fs::relative(entry.path(), root).string(), CodeOf(entry.path()));
    }
  }
}

TEST(PaperBranches, AreListed) {
  std::map<std::string, int> branches, listed;
  const std::regex branch(R"((==|!=|case)\s*(phi::)?Formulas::k(Paper|Robust)|\bIsPaper\(\))");
  ForEachSource([&](const std::string& path, const std::string& code) {
    if (const int count = Count(code, branch); count > 0) branches[path] = count;
  });
  const std::string page = ReadText(fs::path(PHIMVS_SOURCE_DIR) / "docs/development/paper_mode.md");
  const std::regex row(R"(\| `([a-z_/.]+)` \| (\d+) \|)");
  for (std::sregex_iterator it(page.begin(), page.end(), row), end; it != end; ++it)
    listed[(*it)[1]] = std::stoi((*it)[2]);
  EXPECT_GT(branches.size(), 10u);
  for (const auto& [path, count] : branches) {
    EXPECT_EQ(listed[path], count) << path
                                   << ": list its branches on Formulas in docs/development/paper_mode.md";
  }
  for (const auto& [path, count] : listed) {
    EXPECT_EQ(branches.count(path), 1u)
        << path << " stands in docs/development/paper_mode.md, but has no branch";
  }
}

// A flag of another name would hide its branches from the list.
TEST(PaperBranches, HaveOneName) {
  const std::regex other_names(R"(\b(paper|is_paper|robust|is_robust|literal)\b)");
  ForEachSource([&](const std::string& path, const std::string& code) {
    std::smatch match;
    EXPECT_FALSE(std::regex_search(code, match, other_names))
        << path << ": `" << match[0] << "` instead of a comparison with a value of phi::Formulas";
  });
}

}  // namespace

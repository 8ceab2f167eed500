#include "colmap_ext/cli/suggestion.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "colmap_ext/format_text.h"

namespace colmap_ext {
namespace {

std::string LastPart(const std::string& name) { return name.substr(name.find('.') + 1); }

// Letters to insert, take out or replace (Levenshtein).
std::size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string SuggestName(const std::string& word, const std::vector<std::string>& names,
                        const std::string& prefix) {
  using Match =
      std::tuple<std::size_t, std::size_t, std::string>;  // distance of last parts, of the whole, name
  std::vector<Match> matches;
  const std::string whole = Lowercase(word), part = LastPart(whole);
  for (const std::string& name : names) {
    const std::string lower = Lowercase(name);
    const std::size_t distance = EditDistance(part, LastPart(lower));
    if (distance <= part.size() / 3) matches.emplace_back(distance, EditDistance(whole, lower), name);
  }
  if (matches.empty()) return "";
  std::sort(matches.begin(), matches.end());
  // Without its group a name may be several options'.
  const auto is_other = [](const Match& match) { return std::get<0>(match) != 0; };
  const auto end = std::max(std::find_if(matches.begin(), matches.end(), is_other), matches.begin() + 1);
  std::string meant;
  for (auto match = matches.begin(); match != end; ++match)
    meant += (meant.empty() ? "" : " or ") + prefix + std::get<std::string>(*match);
  return " (did you mean " + meant + "?)";
}

}  // namespace colmap_ext

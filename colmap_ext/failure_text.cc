#include "colmap_ext/failure_text.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <map>
#include <tuple>
#include <utility>

namespace colmap_ext {
namespace {

using Group = std::vector<const phi::Message*>;  // of one reason

constexpr std::size_t kMaxNames = 5, kMaxReasons = 10;

// Without a first mention of the image, whose name stands before it already.
std::string SentenceOf(const phi::Message& message) {
  const std::string mention = "image " + message.image + ": ";
  return message.text.starts_with(mention) ? message.text.substr(mention.size()) : message.text;
}

std::string Line(const std::string& names, const phi::Message& message) {
  return names + (message.stage.empty() ? "" : " (" + message.stage + ")") + ": " + SentenceOf(message);
}

std::string WithoutName(std::string text, const std::string& name) {
  if (name.empty()) return text;
  for (std::size_t at = 0; (at = text.find(name, at)) != std::string::npos;) text.erase(at, name.size());
  return text;
}

// Numbers of a path tell one file from another: they stay.
std::string WithoutNumbers(const std::string& text) {
  std::string rest;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size() - 1) + 1;
    std::string word = text.substr(begin, end - begin);
    if (word.find('/') == std::string::npos) std::erase_if(word, [](unsigned char c) { return std::isdigit(c) != 0 || c == '.'; });
    rest += word;
    begin = end;
  }
  return rest;
}

std::string NamesOf(const Group& group) {
  std::string names;
  for (std::size_t i = 0; i < std::min(group.size(), kMaxNames); ++i) names += (i == 0 ? "" : ", ") + group[i]->image;
  return group.size() <= kMaxNames ? names : names + " and " + std::to_string(group.size() - kMaxNames) + " more";
}

}  // namespace

std::string DescribeFailure(const phi::Message& message) { return Line(message.image, message); }

std::vector<std::string> LinesByReason(const std::vector<phi::Message>& messages) {
  std::map<std::pair<std::string, std::string>, Group> by_reason;
  for (const phi::Message& message : messages) {
    by_reason[{message.stage, WithoutNumbers(WithoutName(message.text, message.image))}].push_back(&message);
  }
  std::vector<Group> groups;
  for (auto& [reason, group] : by_reason) {
    std::sort(group.begin(), group.end(), [](const phi::Message* a, const phi::Message* b) {
      return std::tie(a->image, a->text) < std::tie(b->image, b->text);
    });
    groups.push_back(std::move(group));
  }
  std::stable_sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) {
    return a.size() != b.size() ? a.size() > b.size() : a.front()->image < b.front()->image;
  });
  std::vector<std::string> lines;
  std::size_t num_left = messages.size();
  for (std::size_t i = 0; i < std::min(groups.size(), kMaxReasons); ++i) {
    lines.push_back(Line(NamesOf(groups[i]), *groups[i].front()));
    num_left -= groups[i].size();
  }
  if (num_left > 0) {
    lines.push_back(std::to_string(num_left) + " more, for " + std::to_string(groups.size() - kMaxReasons) + " other reasons");
  }
  return lines;
}

std::string ListByReason(const std::string& heading, const std::vector<phi::Message>& messages) {
  std::string text = heading;
  for (const std::string& line : LinesByReason(messages)) text += "\n  " + line;
  return text;
}

}  // namespace colmap_ext

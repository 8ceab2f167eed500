#include "phi/base/rules.h"

#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace phi {
namespace {

constexpr float kMostFactor = 10;

bool IsBetween(RuleStage stage, RuleStage first, RuleStage last) { return stage >= first && stage <= last; }

// kNumRules: none.
std::size_t FindRule(const std::string& name, RuleStage first, RuleStage last) {
  std::size_t i = 0;
  while (i < kNumRules && !(name == kRules[i].name && IsBetween(kRules[i].stage, first, last))) ++i;
  return i;
}

[[noreturn]] void Refuse(RuleStage first, RuleStage last) {
  std::string names;
  for (const RuleDescription& rule : kRules) {
    if (!IsBetween(rule.stage, first, last)) continue;
    const char* settings = rule.settings == RuleSettings::kOff     ? " (0)"
                           : rule.settings == RuleSettings::kScale ? " (not 0)"
                                                                   : "";
    names += std::string(names.empty() ? "" : ", ") + rule.name + settings;
  }
  throw std::invalid_argument("NAME=FACTOR,... with factors between 0 (off) and 10 and these names: " +
                              names);
}

// Negative: not a factor.
float ParseFactor(const std::string& text) {
  float factor = -1;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, factor);
  return error == std::errc() && stop == end && factor <= kMostFactor ? factor : -1;
}

bool IsPossible(RuleSettings settings, float factor) {
  if (factor == 1) return true;
  return settings != (factor == 0 ? RuleSettings::kScale : RuleSettings::kOff);
}

}  // namespace

int Rules::Count(Rule rule, int count) const {
  return static_cast<int>(std::lround(Scale(rule) * static_cast<float>(count)));
}

void Rules::Assign(const std::string& text, RuleStage first, RuleStage last) {
  Rules assigned = *this;
  for (std::size_t i = 0; i < kNumRules; ++i) {
    if (IsBetween(kRules[i].stage, first, last)) assigned.factors_[i] = 1;
  }
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    const std::size_t equals = word.find('=');
    const std::size_t rule = FindRule(word.substr(0, equals), first, last);
    const float factor = equals == std::string::npos ? -1 : ParseFactor(word.substr(equals + 1));
    if (rule == kNumRules || !(factor >= 0) || !IsPossible(kRules[rule].settings, factor))
      Refuse(first, last);
    assigned.factors_[rule] = factor;
  }
  *this = assigned;
}

std::string Rules::Text(RuleStage first, RuleStage last) const {
  std::string text;
  for (std::size_t i = 0; i < kNumRules; ++i) {
    if (factors_[i] == 1 || !IsBetween(kRules[i].stage, first, last)) continue;
    char factor[32];
    const auto end = std::to_chars(factor, factor + sizeof(factor), factors_[i]);
    text += (text.empty() ? "" : ",") + std::string(kRules[i].name) + "=" + std::string(factor, end.ptr);
  }
  return text;
}

std::string Rules::KeyText(RuleStage stage) const {
  const std::string text = Text(stage, stage);
  return text.empty() ? "" : " rules=" + text;
}

}  // namespace phi

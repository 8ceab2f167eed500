// An option described once: the command line, project files, help, checks, the keys of results and other languages'
// bindings are made from the same list.
//
//   OptionList StereoOptions::List() {
//     OptionList list;
//     list.Add("PatchMatchStereo.window_radius", &window_radius, "Half the side of the matching window")
//         .Unit("pixels").Between(1, 32);
//
// The variable's value when it is added is the option's default.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "phi/base/rules.h"

namespace phi {

inline constexpr int kMaxThreads = 1024;  // that options may ask for

class Option {
 public:
  enum class Type { kBool, kInteger, kNumber, kText, kPath, kChoice };

  Option& Unit(const std::string& unit);  // shown in help and messages
  Option& Required();                     // a command without it is refused
  // COLMAP's own default. A project file that COLMAP wrote holds every option; the ones that equal COLMAP's default there
  // were not chosen by anyone and count as unset. May be called once per default that COLMAP has had.
  Option& ColmapDefault(const std::string& value);
  // The values that Check accepts.
  Option& Between(double least, double most);  // both included
  Option& AtLeast(double least);
  Option& MoreThan(double limit);
  Option& LessThan(double limit);
  // Results do not follow from it, or their keys learn of it in another way: `why` is for the reader of the list.
  Option& NotInKey(const char* why);
  // No part of what the program promises: accepted, and in no help.
  Option& ForDevelopers();

  const std::string& name() const { return name_; }
  const std::string& help() const { return help_; }
  const std::string& unit() const { return unit_; }
  Type type() const { return type_; }
  const std::vector<std::string>& choices() const { return choices_; }  // of a kChoice
  const std::string& default_text() const { return default_text_; }
  const std::vector<std::string>& colmap_defaults() const { return colmap_defaults_; }
  bool required() const { return required_; }
  bool in_key() const { return in_key_; }
  bool is_for_developers() const { return is_for_developers_; }

  // The value as it would be written on a command line; it reads back as the same value.
  std::string Text() const { return print_(); }
  // Throws std::invalid_argument that says what a value must be. Check looks at its size.
  void Assign(const std::string& text) { assign_(text); }
  // Empty, or one sentence that names option, value and rule.
  std::string Check() const;

 private:
  friend class OptionList;
  std::string RangeText() const;

  std::string name_, help_, unit_, default_text_;
  Type type_ = Type::kText;
  std::vector<std::string> choices_, colmap_defaults_;
  bool required_ = false, in_key_ = true, is_for_developers_ = false;
  double least_ = -std::numeric_limits<double>::infinity(), most_ = std::numeric_limits<double>::infinity();
  bool is_above_least_ = false, is_below_most_ = false;  // the bound itself is refused
  std::function<void(const std::string&)> assign_;
  std::function<std::string()> print_;
  std::function<double()> number_;  // empty: not a number
};

// References that Add returns stay valid, also when the list is moved. The variables must outlive it.
class OptionList {
 public:
  Option& Add(const std::string& name, bool* value, const std::string& help);
  Option& Add(const std::string& name, int* value, const std::string& help);
  Option& Add(const std::string& name, std::uint32_t* value, const std::string& help);
  Option& Add(const std::string& name, double* value, const std::string& help);
  Option& Add(const std::string& name, std::string* value, const std::string& help);
  Option& Add(const std::string& name, std::filesystem::path* value, const std::string& help);
  // The switches of the rules of some stages (rules.h); for developers.
  Option& AddRules(const std::string& name, Rules* value, RuleStage first, RuleStage last);
  template <typename Value>
  Option& AddChoice(const std::string& name, Value* value, std::vector<std::pair<std::string, Value>> choices,
                    const std::string& help);
  // All of another list's, or those of the names given.
  void Append(OptionList other);
  void Append(OptionList other, const std::vector<std::string>& names);

  Option* Find(const std::string& name);
  const Option* Find(const std::string& name) const { return const_cast<OptionList*>(this)->Find(name); }
  auto begin() { return options_.begin(); }
  auto end() { return options_.end(); }
  auto begin() const { return options_.begin(); }
  auto end() const { return options_.end(); }
  std::size_t size() const { return options_.size(); }

  // The first option's complaint, or an empty string.
  std::string Check() const;
  // "name=value ..." of the options that results follow from.
  std::string KeyText() const;

 private:
  template <typename Number>
  Option& AddNumber(const std::string& name, Number* value, const std::string& help, Option::Type type,
                    const char* rule);
  // Throws std::logic_error for a name that is there already.
  Option& AddOption(const std::string& name, const std::string& help, Option::Type type,
                    std::function<void(const std::string&)> assign, std::function<std::string()> print);

  std::deque<Option> options_;
};

// Whether they differ in capitals at most.
bool SameWord(std::string_view a, std::string_view b);
// "a, b, c"
std::string JoinNames(const std::vector<std::string>& names);
// Throws std::invalid_argument("one of a, b, c").
[[noreturn]] void ThrowNoSuchChoice(const std::vector<std::string>& names);

template <typename Value>
Option& OptionList::AddChoice(const std::string& name, Value* value,
                              std::vector<std::pair<std::string, Value>> choices, const std::string& help) {
  std::vector<std::string> names;
  for (const auto& choice : choices) names.push_back(choice.first);
  const auto assign = [value, choices, names](const std::string& text) {
    for (const auto& [choice, meaning] : choices) {
      if (!SameWord(choice, text)) continue;
      *value = meaning;
      return;
    }
    ThrowNoSuchChoice(names);
  };
  const auto print = [value, choices] {
    for (const auto& [choice, meaning] : choices) {
      if (meaning == *value) return choice;
    }
    return std::string();
  };
  Option& option =
      AddOption(name, help + " {" + JoinNames(names) + "}", Option::Type::kChoice, assign, print);
  option.choices_ = names;
  return option;
}

}  // namespace phi

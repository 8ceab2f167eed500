#include "phi/base/option.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <type_traits>

namespace phi {
namespace {

template <typename T>
T ParseNumber(const std::string& text, const char* rule) {
  T value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end) throw std::invalid_argument(rule);
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(value)) throw std::invalid_argument(rule);
  }
  return value;
}

// The shortest text that reads back as the value.
template <typename T>
std::string PrintNumber(T value) {
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof(buffer), value);
  return std::string(buffer, result.ptr);
}

// The words that COLMAP takes. The first two are what errors name.
bool ParseBool(const std::string& text) {
  const auto is_text = [&](const char* word) { return SameWord(text, word); };
  constexpr const char* kTrue[] = {"true", "1", "yes", "on"};
  constexpr const char* kFalse[] = {"false", "0", "no", "off"};
  if (std::any_of(std::begin(kTrue), std::end(kTrue), is_text)) return true;
  if (std::any_of(std::begin(kFalse), std::end(kFalse), is_text)) return false;
  throw std::invalid_argument("true, false, 1 or 0");
}

}  // namespace

bool SameWord(std::string_view a, std::string_view b) {
  const auto same_letter = [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_letter);
}

std::string JoinNames(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

void ThrowNoSuchChoice(const std::vector<std::string>& names) {
  throw std::invalid_argument("one of " + JoinNames(names));
}

Option& Option::Unit(const std::string& unit) {
  unit_ = unit;
  return *this;
}

Option& Option::Required() {
  required_ = true;
  return *this;
}

Option& Option::ColmapDefault(const std::string& value) {
  colmap_defaults_.push_back(value);
  return *this;
}

Option& Option::Between(double least, double most) {
  least_ = least, most_ = most;
  is_above_least_ = is_below_most_ = false;
  return *this;
}

Option& Option::AtLeast(double least) {
  least_ = least, is_above_least_ = false;
  return *this;
}

Option& Option::MoreThan(double limit) {
  least_ = limit, is_above_least_ = true;
  return *this;
}

Option& Option::LessThan(double limit) {
  most_ = limit, is_below_most_ = true;
  return *this;
}

Option& Option::NotInKey(const char*) {
  in_key_ = false;
  return *this;
}

Option& Option::ForDevelopers() {
  is_for_developers_ = true;
  return *this;
}

std::string Option::RangeText() const {
  const std::string least = PrintNumber(least_), most = PrintNumber(most_);
  const std::string of_unit = unit_.empty() ? "" : " " + unit_;
  if (std::isinf(most_)) return (is_above_least_ ? "more than " + least : "at least " + least) + of_unit;
  if (std::isinf(least_)) return (is_below_most_ ? "less than " + most : "at most " + most) + of_unit;
  if (!is_above_least_ && !is_below_most_) return "between " + least + " and " + most + of_unit;
  return "in " + std::string(is_above_least_ ? "(" : "[") + least + ", " + most +
         (is_below_most_ ? ")" : "]") + of_unit;
}

std::string Option::Check() const {
  if (!number_) return "";
  const double value = number_();
  const bool is_large_enough = is_above_least_ ? value > least_ : value >= least_;
  const bool is_small_enough = is_below_most_ ? value < most_ : value <= most_;
  if (is_large_enough && is_small_enough) return "";
  return "--" + name_ + " is " + Text() + ", but must be " + RangeText();
}

Option& OptionList::AddOption(const std::string& name, const std::string& help, Option::Type type,
                              std::function<void(const std::string&)> assign,
                              std::function<std::string()> print) {
  if (Find(name) != nullptr) throw std::logic_error("option --" + name + " is registered twice");
  Option& option = options_.emplace_back();
  option.name_ = name;
  option.help_ = help;
  option.type_ = type;
  option.assign_ = std::move(assign);
  option.print_ = std::move(print);
  option.default_text_ = option.print_();
  return option;
}

template <typename Number>
Option& OptionList::AddNumber(const std::string& name, Number* value, const std::string& help,
                              Option::Type type, const char* rule) {
  Option& option = AddOption(
      name, help, type, [value, rule](const std::string& text) { *value = ParseNumber<Number>(text, rule); },
      [value] { return PrintNumber(*value); });
  option.number_ = [value] { return static_cast<double>(*value); };
  return option;
}

Option& OptionList::Add(const std::string& name, bool* value, const std::string& help) {
  return AddOption(
      name, help, Option::Type::kBool, [value](const std::string& text) { *value = ParseBool(text); },
      [value] { return std::string(*value ? "true" : "false"); });
}

Option& OptionList::Add(const std::string& name, int* value, const std::string& help) {
  return AddNumber(name, value, help, Option::Type::kInteger, "a whole number");
}

Option& OptionList::Add(const std::string& name, std::uint32_t* value, const std::string& help) {
  return AddNumber(name, value, help, Option::Type::kInteger, "a whole number from 0 to 4294967295");
}

Option& OptionList::Add(const std::string& name, double* value, const std::string& help) {
  return AddNumber(name, value, help, Option::Type::kNumber, "a number");
}

Option& OptionList::Add(const std::string& name, std::string* value, const std::string& help) {
  return AddOption(
      name, help, Option::Type::kText, [value](const std::string& text) { *value = text; },
      [value] { return *value; });
}

Option& OptionList::Add(const std::string& name, std::filesystem::path* value, const std::string& help) {
  return AddOption(
      name, help, Option::Type::kPath, [value](const std::string& text) { *value = text; },
      [value] { return value->string(); });
}

Option& OptionList::AddRules(const std::string& name, Rules* value, RuleStage first, RuleStage last) {
  return AddOption(
             name, "Rules that are off or scaled", Option::Type::kText,
             [=](const std::string& text) { value->Assign(text, first, last); },
             [=] { return value->Text(first, last); })
      .ForDevelopers();
}

void OptionList::Append(OptionList other) {
  for (Option& option : other) {
    if (Find(option.name()) != nullptr)
      throw std::logic_error("option --" + option.name() + " is registered twice");
    options_.push_back(std::move(option));
  }
}

void OptionList::Append(OptionList other, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    Option* option = other.Find(name);
    if (option == nullptr || Find(name) != nullptr)
      throw std::logic_error("no option --" + name + " to take over");
    options_.push_back(std::move(*option));
  }
}

Option* OptionList::Find(const std::string& name) {
  const auto it =
      std::find_if(options_.begin(), options_.end(), [&](const Option& o) { return o.name() == name; });
  return it == options_.end() ? nullptr : &*it;
}

std::string OptionList::Check() const {
  for (const Option& option : options_) {
    if (std::string problem = option.Check(); !problem.empty()) return problem;
  }
  return "";
}

std::string OptionList::KeyText() const {
  std::string text;
  for (const Option& option : options_) {
    if (option.in_key()) text += " " + option.name() + "=" + option.Text();
  }
  return text;
}

}  // namespace phi

#include "colmap_ext/cli/option_parser.h"

#include <unistd.h>
#include <boost/program_options.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "colmap_ext/cli/suggestion.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/terminal.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace po = boost::program_options;

constexpr int kNarrowestHelp = 60, kWidestHelp = 120;  // columns
constexpr std::size_t kMaxListedKeys = 8;

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

template <typename T>
std::string PrintNumber(T value) {
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof(buffer), value);
  return std::string(buffer, result.ptr);
}

bool ParseBool(const std::string& text) {
  if (text == "true" || text == "1") return true;
  if (text == "false" || text == "0") return false;
  throw std::invalid_argument("true, false, 1 or 0");
}

// COLMAP keeps some options in single precision and writes them with 17 digits: 0.01 becomes
// 0.0099999997764825821.
bool SameValue(const std::string& a, const std::string& b) {
  if (a == b) return true;
  const auto as_bool = [](const std::string& s) {
    return s == "true" ? "1" : s == "false" ? "0" : s.c_str();
  };
  char* end_a = nullptr;
  char* end_b = nullptr;
  const std::string ta = as_bool(a), tb = as_bool(b);
  const double va = std::strtod(ta.c_str(), &end_a), vb = std::strtod(tb.c_str(), &end_b);
  if (ta.empty() || tb.empty() || *end_a != 0 || *end_b != 0) return false;
  return std::abs(va - vb) <= 1e-6 * std::max(std::abs(va), std::abs(vb));
}

std::string GroupOf(const std::string& name) {
  const std::size_t dot = name.find('.');
  return dot == std::string::npos ? "" : name.substr(0, dot);
}

// "a, b, c and 7 more"
std::string ListKeys(const std::vector<std::string>& keys) {
  std::string text;
  for (std::size_t i = 0; i < std::min(keys.size(), kMaxListedKeys); ++i) text += (i ? ", " : "") + keys[i];
  if (keys.size() > kMaxListedKeys) text += " and " + std::to_string(keys.size() - kMaxListedKeys) + " more";
  return text;
}

}  // namespace

OptionParser::Option& OptionParser::Option::Unit(const std::string& text) {
  unit = text;
  return *this;
}

OptionParser::Option& OptionParser::Option::Required() {
  required = true;
  return *this;
}

OptionParser::Option& OptionParser::Option::ColmapDefault(const std::string& value) {
  colmap_defaults.push_back(value);
  return *this;
}

OptionParser::OptionParser(std::string command, std::string summary)
    : command_(std::move(command)), summary_(std::move(summary)) {
  Add("project_path", &project_path_,
      "Read options from this .ini file; those on the command line win over it");
  Add("log_level", &log_level_,
      "What is logged: 0 = errors, 1 = also warnings, 2 = also progress, 3 = all details")
      .ColmapDefault("0")
      .ColmapDefault("2");
  Add("log_timestamps", &log_timestamps_, "Begin each line of the log with the time of day (UTC)");
  Add("default_random_seed", &random_seed_,
      "Seed of all random numbers; the same seed gives the same maps, byte by byte")
      .ColmapDefault("0");
  AddColmapOnly("random_seed", "0", "newer versions of COLMAP and phimvs call it --default_random_seed");
  AddColmapOnly("log_to_stderr", "0", "the log always goes to stderr");
  AddColmapOnly("log_target", "stderr_and_file", "the log always goes to stderr");
  AddColmapOnly("log_severity", "0", "--log_level says what is logged");
  AddColmapOnly("log_color", "1", "the log has no colours");
}

OptionParser::Option& OptionParser::AddOption(const std::string& name, const std::string& help) {
  if (Find(name)) throw std::logic_error("option --" + name + " is registered twice");
  Option& option = options_.emplace_back();
  option.name = name;
  option.help = help;
  return option;
}

OptionParser::Option& OptionParser::Add(const std::string& name, bool* value, const std::string& help) {
  Option& option = AddOption(name, help);
  option.assign = [value](const std::string& text) { *value = ParseBool(text); };
  option.print = [value] { return std::string(*value ? "true" : "false"); };
  option.default_text = option.print();
  return option;
}

OptionParser::Option& OptionParser::Add(const std::string& name, int* value, const std::string& help) {
  Option& option = AddOption(name, help);
  option.assign = [value](const std::string& text) { *value = ParseNumber<int>(text, "a whole number"); };
  option.print = [value] { return PrintNumber(*value); };
  option.default_text = option.print();
  return option;
}

OptionParser::Option& OptionParser::Add(const std::string& name, std::int64_t* value,
                                        const std::string& help) {
  Option& option = AddOption(name, help);
  option.assign = [value](const std::string& text) {
    *value = ParseNumber<std::int64_t>(text, "a whole number");
  };
  option.print = [value] { return PrintNumber(*value); };
  option.default_text = option.print();
  return option;
}

OptionParser::Option& OptionParser::Add(const std::string& name, std::uint32_t* value,
                                        const std::string& help) {
  Option& option = AddOption(name, help);
  option.assign = [value](const std::string& text) {
    *value = ParseNumber<std::uint32_t>(text, "a whole number from 0 to 4294967295");
  };
  option.print = [value] { return PrintNumber(*value); };
  option.default_text = option.print();
  return option;
}

OptionParser::Option& OptionParser::Add(const std::string& name, double* value, const std::string& help) {
  Option& option = AddOption(name, help);
  option.assign = [value](const std::string& text) { *value = ParseNumber<double>(text, "a number"); };
  option.print = [value] { return PrintNumber(*value); };
  option.default_text = option.print();
  return option;
}

OptionParser::Option& OptionParser::Add(const std::string& name, std::string* value,
                                        const std::string& help) {
  Option& option = AddOption(name, help);
  option.assign = [value](const std::string& text) { *value = text; };
  option.print = [value] { return *value; };
  option.default_text = option.print();
  return option;
}

OptionParser::Option& OptionParser::Add(const std::string& name, std::filesystem::path* value,
                                        const std::string& help) {
  Option& option = AddOption(name, help);
  option.assign = [value](const std::string& text) { *value = text; };
  option.print = [value] { return value->string(); };
  option.default_text = option.print();
  return option;
}

void OptionParser::AddPreset(const std::string& name, const Values& values) {
  if (presets_.empty()) {
    presets_[preset_] = {};
    Option& option = AddOption("preset", "");
    option.assign = [this](const std::string& text) {
      if (presets_.count(text) == 0) throw std::invalid_argument("one of " + ChoiceRule(PresetNames()));
      preset_ = text;
    };
    option.print = [this] { return preset_; };
    option.default_text = preset_;
  }
  Values& all = presets_[name];
  all.insert(all.end(), values.begin(), values.end());
  Find("preset")->help =
      "Values for the options that are not set; robust = the defaults {" + ChoiceRule(PresetNames()) + "}";
}

std::vector<std::string> OptionParser::PresetNames() const {
  std::vector<std::string> names;
  for (const auto& [name, values] : presets_) names.push_back(name);
  return names;
}

void OptionParser::ApplyPreset() {
  if (presets_.empty()) return;
  for (const auto& [name, value] : presets_.at(preset_)) {
    Option* option = Find(name);
    if (option == nullptr) continue;  // a command may have some of the preset's options only
    if (!IsSet(name)) {
      option->assign(value);
    } else if (!SameValue(option->print(), value)) {
      phi::LogInfo("--" + name + " " + option->print() + " goes before the " + value + " of --preset " +
                   preset_);
    }
  }
}

void OptionParser::AddColmapOnly(const std::string& name, const std::string& colmap_default,
                                 const std::string& why) {
  Option& option = AddOption(name, why);
  option.only_colmap = true;
  option.colmap_defaults = {colmap_default};
  option.assign = [](const std::string&) {};
  option.print = [] { return std::string(); };
}

OptionParser::Option* OptionParser::Find(const std::string& name) {
  const auto it =
      std::find_if(options_.begin(), options_.end(), [&](const Option& o) { return o.name == name; });
  return it == options_.end() ? nullptr : &*it;
}

std::string OptionParser::ChoiceRule(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

OptionParser::Values OptionParser::ReadCommandLine(int argc, const char* const* argv, bool* help) const {
  po::options_description description;
  description.add_options()("help,h", "");
  for (const Option& option : options_)
    description.add_options()(option.name.c_str(), po::value<std::string>(), "");
  Values values;
  try {
    const auto options = po::command_line_parser(argc, argv).options(description).run();
    for (const auto& option : options.options) {
      if (option.position_key < 0) continue;
      throw phi::UsageError("'" + option.value.front() + "' belongs to no option; see `phimvs " + command_ +
                            " --help`");
    }
    po::variables_map parsed;
    po::store(options, parsed);
    *help = parsed.count("help") > 0;
    for (const auto& [name, value] : parsed) {
      if (name != "help") values.emplace_back(name, value.as<std::string>());
    }
  } catch (const po::unknown_option& error) {
    std::vector<std::string> names;
    for (const Option& option : options_) names.push_back(option.name);
    std::string word = error.get_option_name();
    word.erase(0, word.find_first_not_of('-'));
    throw phi::UsageError("there is no option '--" + word + "'" + SuggestName(word, names, "--") +
                          "; see `phimvs " + command_ + " --help`");
  } catch (const po::error& error) {
    throw phi::UsageError(std::string(error.what()) + "; see `phimvs " + command_ + " --help`");
  }
  return values;
}

OptionParser::Values OptionParser::ReadProjectFile(const std::filesystem::path& path) {
  std::ifstream file = OpenRegularFile(path);
  if (!file) {
    throw phi::InputError("--project_path: " + path.string() + " is no file that can be read");
  }
  po::options_description none;
  Values values, chosen;
  try {
    for (const auto& entry : po::parse_config_file(file, none, true).options) {
      values.emplace_back(entry.string_key, entry.value.empty() ? "" : entry.value.front());
    }
  } catch (const po::error& error) {
    throw phi::InputError("--project_path: " + path.string() + ": " + error.what());
  }
  // A key that only COLMAP has gives away who wrote the file.
  const bool by_colmap = std::any_of(values.begin(), values.end(), [&](const auto& entry) {
    const Option* option = Find(entry.first);
    return option && option->only_colmap;
  });
  std::vector<std::string> unknown, unset;
  for (auto& [key, value] : values) {
    const Option* option = Find(key);
    const auto is_value = [&, v = value](const std::string& other) { return SameValue(v, other); };
    if (!option) {
      unknown.push_back(key);
    } else if (by_colmap &&
               std::any_of(option->colmap_defaults.begin(), option->colmap_defaults.end(), is_value)) {
      if (!option->only_colmap) unset.push_back(key);
    } else {
      chosen.emplace_back(key, value);
    }
  }
  if (!unknown.empty()) {
    phi::LogWarning(path.string() + ": " + command_ + " does not use " + ListKeys(unknown));
  }
  if (!unset.empty()) {
    phi::LogInfo(
        path.string() +
        " was written by COLMAP; equal to COLMAP's defaults and so taken as unset: " + ListKeys(unset));
  }
  return chosen;
}

void OptionParser::Assign(Option& option, const std::string& value, const std::string& origin) {
  try {
    option.assign(value);
  } catch (const std::invalid_argument& rule) {
    const std::string message = "--" + option.name + " is '" + value + "', but must be " + rule.what();
    if (origin.empty()) throw phi::UsageError(message);
    throw phi::InputError(origin + ": " + message);
  }
  set_.insert(option.name);
}

bool OptionParser::Parse(int argc, const char* const* argv) {
  bool help = false;
  const Values command_line = ReadCommandLine(argc, argv, &help);
  if (help) {
    PrintHelp();
    return false;
  }
  for (const auto& [name, value] : command_line) {
    if (name == "project_path" || name == "log_level" || name == "log_timestamps")
      Assign(*Find(name), value, "");
  }
  ApplyLogOptions();
  if (!project_path_.empty()) {
    for (const auto& [name, value] : ReadProjectFile(project_path_)) {
      if (name != "project_path") Assign(*Find(name), value, project_path_.string());
    }
  }
  for (const auto& [name, value] : command_line) Assign(*Find(name), value, "");
  ApplyLogOptions();
  ApplyPreset();
  CheckRequired();
  WarnColmapOnly();
  LogEffectiveValues();
  return true;
}

void OptionParser::ApplyLogOptions() const {
  phi::SetLogLevel(static_cast<phi::LogLevel>(std::clamp(log_level_, 0, 3)));
  phi::SetLogTimestamps(log_timestamps_);
}

void OptionParser::CheckRequired() const {
  for (const Option& option : options_) {
    if (option.required && (!IsSet(option.name) || option.print().empty())) {
      throw phi::UsageError("--" + option.name + " is required; see `phimvs " + command_ + " --help`");
    }
  }
}

void OptionParser::WarnColmapOnly() const {
  for (const Option& option : options_) {
    if (option.only_colmap && IsSet(option.name)) {
      phi::LogWarning("--" + option.name + " has no effect: " + option.help);
    }
  }
}

void OptionParser::WarnWithoutEffect(const std::vector<std::string>& names, const std::string& why) const {
  for (const std::string& name : names) {
    if (IsSet(name)) phi::LogWarning("--" + name + " has no effect: " + why);
  }
}

std::map<std::string, std::string> OptionParser::EffectiveValues() const {
  std::map<std::string, std::string> values;
  for (const Option& option : options_) {
    if (!option.only_colmap) values[option.name] = option.print();
  }
  return values;
}

void OptionParser::LogEffectiveValues() const {
  std::map<std::string, std::string> lines;
  for (const auto& [name, value] : EffectiveValues()) {
    const std::string group = GroupOf(name);
    lines[group] += " " + (group.empty() ? name : name.substr(group.size() + 1)) + "=" + value;
  }
  for (const auto& [group, line] : lines) {
    phi::LogDebug((group.empty() ? "options" : "options " + group) + ":" + line);
  }
  std::string chosen;
  for (const Option& option : options_) {
    const bool tells_nothing = option.only_colmap || option.required || option.name == "project_path" ||
                               option.name.starts_with("log_");
    if (!tells_nothing && IsSet(option.name) && option.print() != option.default_text)
      chosen += " --" + option.name + " " + option.print();
  }
  if (!chosen.empty()) phi::LogInfo("options:" + chosen);
}

void OptionParser::PrintHelp() const {
  const int columns = std::clamp(TerminalColumns(STDOUT_FILENO), kNarrowestHelp, kWidestHelp);
  const int description_columns = columns * 5 / 8;  // long names have lines of their own
  std::map<std::string, po::options_description> groups;
  for (const Option& option : options_) {
    if (option.only_colmap) continue;
    const std::string group = GroupOf(option.name);
    auto it =
        groups.try_emplace(group, group.empty() ? "Options" : group, columns, description_columns).first;
    auto* value = po::value<std::string>();
    if (!option.default_text.empty()) value->default_value(option.default_text);
    std::string help = option.help;
    if (!option.unit.empty()) help += " [" + option.unit + "]";
    if (option.required) help += " (required)";
    it->second.add_options()(option.name.c_str(), value, help.c_str());
  }
  std::cout << WrapText("phimvs " + command_ + ": " + summary_, columns, 2) << "\n";
  for (const auto& [group, description] : groups) std::cout << "\n" << description;
  std::string only_colmap = " ";
  for (const Option& option : options_) {
    if (option.only_colmap) only_colmap += " --" + option.name;
  }
  std::cout << "\nCOLMAP's options without a counterpart are accepted and have no effect:\n"
            << WrapText(only_colmap, columns, 2) << std::endl;
}

}  // namespace colmap_ext

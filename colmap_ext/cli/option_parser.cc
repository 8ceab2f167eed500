#include "colmap_ext/cli/option_parser.h"

#include <boost/program_options.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "colmap_ext/cli/option_help.h"
#include "colmap_ext/cli/suggestion.h"
#include "colmap_ext/config_lines.h"
#include "phi/base/c_locale.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace po = boost::program_options;

constexpr std::size_t kMaxListedKeys = 8;
constexpr char kJsonWord[] = "help_json";
// As COLMAP calls it in versions up to 3.
constexpr char kSeedName[] = "default_random_seed", kFormerSeedName[] = "random_seed";

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
  const double va = phi::ParseDouble(ta, &end_a), vb = phi::ParseDouble(tb, &end_b);
  if (ta.empty() || tb.empty() || *end_a != 0 || *end_b != 0) return false;
  return std::abs(va - vb) <= 1e-6 * std::max(std::abs(va), std::abs(vb));
}

std::string CurrentName(const std::string& name) { return name == kFormerSeedName ? kSeedName : name; }

// As COLMAP, which takes no option twice either.
void RefuseRepetitions(const std::filesystem::path& path, const std::vector<ProjectEntry>& entries) {
  std::map<std::string, int> line_of;
  for (const ProjectEntry& entry : entries) {
    const auto [first, is_new] = line_of.emplace(CurrentName(entry.name), entry.line);
    if (is_new) continue;
    throw phi::InputError(LineText(path, entry.line) + entry.name + " is the option of line " +
                          std::to_string(first->second) + " again; leave one of them out");
  }
}

// "a, b, c and 7 more"
std::string ListKeys(const std::vector<std::string>& keys) {
  std::string text;
  for (std::size_t i = 0; i < std::min(keys.size(), kMaxListedKeys); ++i) text += (i ? ", " : "") + keys[i];
  if (keys.size() > kMaxListedKeys) text += " and " + std::to_string(keys.size() - kMaxListedKeys) + " more";
  return text;
}

// What is wrong with a command line, in a sentence of our own: Boost's what() never returns where an option's name holds one
// of its placeholders, such as %canonical_option%.
std::string WhyRefused(const po::error_with_option_name& error) {
  const std::string option = error.get_option_name();
  if (const auto* ambiguous = dynamic_cast<const po::ambiguous_option*>(&error)) {
    std::string names;
    for (const std::string& name : ambiguous->alternatives()) names += (names.empty() ? "--" : " or --") + name;
    return option + " may be " + names;
  }
  if (dynamic_cast<const po::multiple_occurrences*>(&error) != nullptr) return option + " is given more than once";
  const auto* syntax = dynamic_cast<const po::invalid_syntax*>(&error);
  const bool has_too_much = syntax != nullptr && syntax->kind() == po::invalid_syntax::extra_parameter;
  return option + (has_too_much ? " takes no value" : " needs a value");
}

}  // namespace

OptionParser::OptionParser(std::string command, std::string summary)
    : command_(std::move(command)), summary_(std::move(summary)) {
  Add("project_path", &project_path_,
      "Read options from this .ini file; those on the command line win over it");
  Add("log_level", &log_level_,
      "What is logged: 0 = errors, 1 = also warnings, 2 = also progress, 3 = all details")
      .ColmapDefault("0")
      .ColmapDefault("2");
  Add("log_timestamps", &log_timestamps_, "Begin each line of the log with the time of day (UTC)");
  Add(kSeedName, &random_seed_,
      "Seed of all random numbers, --random_seed in COLMAP 3; the same seed gives the same maps, byte by byte")
      .ColmapDefault("0");
  AddColmapOnly("log_to_stderr", "0", "the log always goes to stderr");
  AddColmapOnly("log_target", "stderr_and_file", "the log always goes to stderr");
  AddColmapOnly("log_path", "", "the log always goes to stderr");
  AddColmapOnly("log_severity", "0", "--log_level says what is logged");
  AddColmapOnly("log_color", "1", "the log has no colours");
}

void OptionParser::AddPaperPreset(const Values& values) {
  if (paper_preset_.empty()) {
    AddChoice<std::string>("preset", &preset_, {{"robust", "robust"}, {"paper", "paper"}},
                           "Values for the options that are not set; robust = the defaults");
  }
  paper_preset_.insert(paper_preset_.end(), values.begin(), values.end());
}

void OptionParser::ApplyPreset() {
  if (preset_ != "paper") return;
  for (const auto& [name, value] : paper_preset_) {
    phi::Option* option = options_.Find(name);
    if (option == nullptr) continue;  // a command may have some of the preset's options only
    if (!IsSet(name)) {
      option->Assign(value);
    } else if (!SameValue(option->Text(), value)) {
      TellUnlessDescribing(phi::LogLevel::kInfo,
                           "--" + name + " " + option->Text() + " goes before the " + value + " of --preset paper");
    }
  }
}

void OptionParser::AddColmapOnly(const std::string& name, const std::string& colmap_default, const std::string& why) {
  if (options_.Find(name) != nullptr || !only_colmap_.emplace(name, ColmapOnly{colmap_default, why}).second)
    throw std::logic_error("option --" + name + " is registered twice");
}

OptionParser::Values OptionParser::ReadCommandLine(int argc, const char* const* argv, bool* help, bool* json) const {
  po::options_description description;
  description.add_options()("help,h", "")(kJsonWord, "");
  for (const std::string& name : AllNames()) description.add_options()(name.c_str(), po::value<std::string>(), "");
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
    *json = parsed.count(kJsonWord) > 0;
    for (const auto& [name, value] : parsed) {
      if (name != "help" && name != kJsonWord) values.emplace_back(CurrentName(name), value.as<std::string>());
    }
    if (parsed.count(kSeedName) > 0 && parsed.count(kFormerSeedName) > 0) {
      throw phi::UsageError(std::string("--") + kFormerSeedName + " and --" + kSeedName +
                            " are the same option; leave one of them out");
    }
  } catch (const po::unknown_option& error) {
    const std::string given = error.get_option_name();
    const std::string word = given.substr(std::min(given.find_first_not_of('-'), given.size()));
    throw phi::UsageError("there is no option '" + given + "'" + SuggestName(word, AllNames(), "--") +
                          "; see `phimvs " + command_ + " --help`");
  } catch (const po::error_with_option_name& error) {
    throw phi::UsageError(WhyRefused(error) + "; see `phimvs " + command_ + " --help`");
  }
  return values;
}

std::vector<ProjectEntry> OptionParser::ChosenEntries(const std::filesystem::path& path) const {
  std::vector<ProjectEntry> entries = ReadProjectFile(path), chosen;
  RefuseRepetitions(path, entries);
  for (ProjectEntry& entry : entries) entry.name = CurrentName(entry.name);
  // A key that only COLMAP has gives away who wrote the file.
  const bool by_colmap =
      std::any_of(entries.begin(), entries.end(), [&](const ProjectEntry& entry) { return IsColmapOnly(entry.name); });
  std::vector<std::string> unknown, unset;
  for (ProjectEntry& entry : entries) {
    const phi::Option* option = options_.Find(entry.name);
    const auto is_value = [&](const std::string& other) { return SameValue(entry.value, other); };
    if (IsColmapOnly(entry.name)) {
      if (!is_value(only_colmap_.at(entry.name).colmap_default)) chosen.push_back(std::move(entry));
    } else if (option == nullptr) {
      unknown.push_back(entry.name);
    } else if (by_colmap && std::any_of(option->colmap_defaults().begin(), option->colmap_defaults().end(), is_value)) {
      unset.push_back(entry.name);
    } else {
      chosen.push_back(std::move(entry));
    }
  }
  if (!unknown.empty()) {
    TellUnlessDescribing(phi::LogLevel::kWarning, path.string() + ": " + command_ + " does not use " + ListKeys(unknown));
  }
  if (!unset.empty()) {
    TellUnlessDescribing(
        phi::LogLevel::kInfo,
        path.string() +
        " was written by COLMAP; equal to COLMAP's defaults and so taken as unset: " + ListKeys(unset));
  }
  return chosen;
}

CommandDescription OptionParser::Describe() const {
  std::vector<std::string> only_colmap;
  for (const auto& [name, colmap] : only_colmap_) only_colmap.push_back(name);
  return {command_, summary_, options_, only_colmap};
}

std::vector<std::string> OptionParser::AllNames() const {
  std::vector<std::string> names;
  for (const phi::Option& option : options_) names.push_back(option.name());
  for (const auto& [name, colmap] : only_colmap_) names.push_back(name);
  names.emplace_back(kFormerSeedName);
  return names;
}

void OptionParser::Assign(const std::string& name, const std::string& value, const phi::Message& origin) {
  origins_[name] = origin;
  if (IsColmapOnly(name)) return;
  try {
    options_.Find(name)->Assign(value);
  } catch (const std::invalid_argument& rule) {
    const std::string message = "--" + name + " is '" + value + "', but must be " + rule.what();
    if (origin.empty()) throw phi::UsageError(message);
    throw phi::InputError(origin + message);
  }
}

void OptionParser::CheckRanges() const {
  for (const phi::Option& option : options_) {
    const std::string problem = option.Check();
    if (problem.empty()) continue;
    const auto origin = origins_.find(option.name());
    if (origin == origins_.end() || origin->second.empty()) throw phi::UsageError(problem);
    throw phi::InputError(origin->second + problem);
  }
}

bool OptionParser::Parse(int argc, const char* const* argv) {
  bool help = false, json = false;
  const Values command_line = ReadCommandLine(argc, argv, &help, &json);
  is_describing_ = json;
  if (help) {
    PrintHelp(Describe());
    return false;
  }
  for (const auto& [name, value] : command_line) {
    if (name == "project_path" || name == "log_level" || name == "log_timestamps")
      Assign(name, value, "");
  }
  ApplyLogOptions();
  if (!project_path_.empty()) {
    for (const ProjectEntry& entry : ChosenEntries(project_path_)) {
      if (entry.name != "project_path") Assign(entry.name, entry.value, LineText(project_path_, entry.line));
    }
  }
  for (const auto& [name, value] : command_line) Assign(name, value, "");
  ApplyLogOptions();
  ApplyPreset();
  if (!json) CheckRequired();
  CheckRanges();
  if (json) {
    PrintJsonHelp(Describe());
    return false;
  }
  WarnColmapOnly();
  LogEffectiveValues();
  return true;
}

void OptionParser::TellUnlessDescribing(phi::LogLevel level, const std::string& message) const {
  if (!is_describing_) phi::Log(level, message);
}

void OptionParser::ApplyLogOptions() const {
  if (is_describing_) return;
  phi::SetLogLevel(static_cast<phi::LogLevel>(std::clamp(log_level_, 0, 3)));
  phi::SetLogTimestamps(log_timestamps_);
}

void OptionParser::CheckRequired() const {
  for (const phi::Option& option : options_) {
    if (option.required() && (!IsSet(option.name()) || option.Text().empty())) {
      throw phi::UsageError("--" + option.name() + " is required; see `phimvs " + command_ + " --help`");
    }
  }
}

void OptionParser::WarnColmapOnly() const {
  for (const auto& [name, colmap] : only_colmap_) {
    if (IsSet(name)) phi::LogWarning("--" + name + " has no effect: " + colmap.why);
  }
}

void OptionParser::WarnWithoutEffect(const std::vector<std::string>& names, const std::string& why) const {
  for (const std::string& name : names) {
    if (IsSet(name)) phi::LogWarning("--" + name + " has no effect: " + why);
  }
}

std::map<std::string, std::string> OptionParser::EffectiveValues() const {
  std::map<std::string, std::string> values;
  for (const phi::Option& option : options_) values[option.name()] = option.Text();
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
  for (const phi::Option& option : options_) {
    const bool tells_nothing =
        option.required() || option.name() == "project_path" || option.name().starts_with("log_");
    if (!tells_nothing && IsSet(option.name()) && option.Text() != option.default_text())
      chosen += " --" + option.name() + " " + option.Text();
  }
  if (!chosen.empty()) phi::LogInfo("options:" + chosen);
}

}  // namespace colmap_ext

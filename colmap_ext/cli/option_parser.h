// Options of a command, with COLMAP's grammar: `--snake_case value`, `--Group.name value`, booleans true/false/1/0,
// `--project_path x.ini` (command line > ini > default; unknown ini keys warn), `--help`/`-h` on stdout.
//
//   OptionParser parser("patch_match_stereo", "Estimate depth and normal maps");
//   parser.Append(options.List());
//   if (!parser.Parse(argc, argv)) return 0;  // help was asked for
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/cli/option_help.h"
#include "colmap_ext/cli/project_file.h"
#include "phi/base/log.h"
#include "phi/base/option.h"

namespace colmap_ext {

class OptionParser {
 public:
  OptionParser(std::string command, std::string summary);

  // See phi::OptionList.
  template <typename Value>
  phi::Option& Add(const std::string& name, Value* value, const std::string& help) {
    return options_.Add(name, value, help);
  }
  template <typename Value>
  phi::Option& AddChoice(const std::string& name, Value* value, std::vector<std::pair<std::string, Value>> choices,
                         const std::string& help) {
    return options_.AddChoice(name, value, std::move(choices), help);
  }
  void Append(phi::OptionList list) { options_.Append(std::move(list)); }

  // Values that `--preset paper` gives to options which neither the command line nor the project file set; the log names
  // those that were set to others. The first call adds the option --preset, whose default, robust, sets nothing.
  using Values = std::vector<std::pair<std::string, std::string>>;
  void AddPaperPreset(const Values& values);

  // An option of COLMAP's without a counterpart here: accepted, and one warning says why it has no effect.
  void AddColmapOnly(const std::string& name, const std::string& colmap_default, const std::string& why);

  // Assigns the values, checks their ranges, applies --log_level and logs the values that differ from the defaults; all at
  // level 3. False when help was asked for (and printed), or --help_json, which is for programs: after the checks it prints
  // the command and its options as a JSON object (see JsonHelp), asks for no required option and leaves the log alone. Throws
  // phi::UsageError for the command line and phi::InputError for a project file.
  bool Parse(int argc, const char* const* argv);

  // Whether the command line or the project file gave the option a value; a preset does not count.
  bool IsSet(const std::string& name) const { return origins_.count(name) > 0; }
  // Warns of those of the options that are set, since `why` leaves them without effect.
  void WarnWithoutEffect(const std::vector<std::string>& names, const std::string& why) const;
  // --default_random_seed, which every command accepts as COLMAP's do, under its former name too.
  std::uint32_t random_seed() const { return random_seed_; }
  // Every option with an effect and its value, as it could be written on a command line.
  std::map<std::string, std::string> EffectiveValues() const;

 private:
  Values ReadCommandLine(int argc, const char* const* argv, bool* help, bool* json) const;
  // Those of a project file that somebody chose.
  std::vector<ProjectEntry> ChosenEntries(const std::filesystem::path& path) const;
  // origin: what errors begin with, "FILE: line N: "; empty for the command line.
  void Assign(const std::string& name, const std::string& value, const phi::Message& origin);
  bool IsColmapOnly(const std::string& name) const { return only_colmap_.contains(name); }
  CommandDescription Describe() const;
  std::vector<std::string> AllNames() const;
  void ApplyPreset();
  void ApplyLogOptions() const;
  void TellUnlessDescribing(phi::LogLevel level, const std::string& message) const;
  void WarnColmapOnly() const;
  void CheckRequired() const;
  void CheckRanges() const;
  void LogEffectiveValues() const;

  std::string command_, summary_;
  phi::OptionList options_;
  std::map<std::string, phi::Message> origins_;  // of the options that are set; see Assign
  // Accepted, without effect, a warning when set: the value that COLMAP gives it, and why.
  struct ColmapOnly {
    std::string colmap_default, why;
  };
  std::map<std::string, ColmapOnly> only_colmap_;
  Values paper_preset_;
  std::string preset_ = "robust";
  std::filesystem::path project_path_;
  int log_level_ = 2;
  bool log_timestamps_ = false;
  std::uint32_t random_seed_ = 0;
  bool is_describing_ = false;  // --help_json: a run of another thread may have the log
};

}  // namespace colmap_ext

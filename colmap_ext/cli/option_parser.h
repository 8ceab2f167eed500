// Options of a command, with COLMAP's grammar: `--snake_case value`, `--Group.name value`, booleans
// true/false/1/0,
// `--project_path x.ini` (command line > ini > default; unknown ini keys warn), `--help`/`-h` on stdout.
//
//   OptionParser parser("patch_match_stereo", "Estimate depth and normal maps");
//   parser.Add("workspace_path", &options.path, "Undistorted workspace").Required();
//   parser.Add("PatchMatchStereo.num_iterations", &options.num_iterations, "Propagation
//   rounds").ColmapDefault("5"); if (!parser.Parse(argc, argv)) return 0;  // help was asked for
//
// The variable's value at registration is the default that help shows.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace colmap_ext {

class OptionParser {
 public:
  class Option {
   public:
    // Unit of the value, shown in help.
    Option& Unit(const std::string& unit);
    // Parse() refuses a command without this option.
    Option& Required();
    // COLMAP's own default. A project file that COLMAP wrote holds every option; the ones that equal COLMAP's
    // default there were not chosen by anyone and count as unset. May be called once per default COLMAP has
    // had.
    Option& ColmapDefault(const std::string& value);

   private:
    friend class OptionParser;
    std::string name, help, unit, default_text;
    std::vector<std::string> colmap_defaults;
    bool required = false;
    bool only_colmap = false;                        // accepted, has no effect, warns once when set
    std::function<void(const std::string&)> assign;  // throws std::invalid_argument with the rule
    std::function<std::string()> print;
  };

  OptionParser(std::string command, std::string summary);

  Option& Add(const std::string& name, bool* value, const std::string& help);
  Option& Add(const std::string& name, int* value, const std::string& help);
  Option& Add(const std::string& name, std::int64_t* value, const std::string& help);
  Option& Add(const std::string& name, std::uint32_t* value, const std::string& help);
  Option& Add(const std::string& name, double* value, const std::string& help);
  Option& Add(const std::string& name, std::string* value, const std::string& help);
  Option& Add(const std::string& name, std::filesystem::path* value, const std::string& help);

  template <typename Enum>
  Option& AddChoice(const std::string& name, Enum* value, std::vector<std::pair<std::string, Enum>> choices,
                    const std::string& help);

  // Values that `--preset NAME` gives to options which neither the command line nor the project file set; the log names
  // those that were set to others. The first call adds the option --preset, whose default, robust, sets nothing. Several
  // calls may add to one preset. All the options must be registered before Parse.
  using Values = std::vector<std::pair<std::string, std::string>>;
  void AddPreset(const std::string& name, const Values& values);

  // An option of COLMAP's without a counterpart here: accepted, and one warning says why it has no effect.
  void AddColmapOnly(const std::string& name, const std::string& colmap_default, const std::string& why);

  // Assigns the values, applies --log_level and logs the values that differ from the defaults; all at level 3. False when help was asked for (and
  // printed). Throws phi::UsageError for the command line and phi::InputError for a project file.
  bool Parse(int argc, const char* const* argv);

  // Whether the command line or the project file gave the option a value; a preset does not count.
  bool IsSet(const std::string& name) const { return set_.count(name) > 0; }
  // Warns of those of the options that are set, since `why` leaves them without effect.
  void WarnWithoutEffect(const std::vector<std::string>& names, const std::string& why) const;
  // --default_random_seed, which every command accepts as COLMAP's do.
  std::uint32_t random_seed() const { return random_seed_; }
  // Every option with an effect and its value, as it could be written on a command line.
  std::map<std::string, std::string> EffectiveValues() const;

 private:
  Option& AddOption(const std::string& name, const std::string& help);
  Option* Find(const std::string& name);
  Values ReadCommandLine(int argc, const char* const* argv, bool* help) const;
  Values ReadProjectFile(const std::filesystem::path& path);
  void Assign(Option& option, const std::string& value, const std::string& origin);
  std::vector<std::string> PresetNames() const;
  void ApplyPreset();
  void ApplyLogOptions() const;
  void WarnColmapOnly() const;
  void CheckRequired() const;
  void LogEffectiveValues() const;
  void PrintHelp() const;
  static std::string ChoiceRule(const std::vector<std::string>& names);

  std::string command_, summary_;
  std::deque<Option> options_;  // deque: Add returns references that must stay valid
  std::set<std::string> set_;
  std::map<std::string, Values> presets_;
  std::string preset_ = "robust";
  std::filesystem::path project_path_;
  int log_level_ = 2;
  bool log_timestamps_ = false;
  std::uint32_t random_seed_ = 0;
};

template <typename Enum>
OptionParser::Option& OptionParser::AddChoice(const std::string& name, Enum* value,
                                              std::vector<std::pair<std::string, Enum>> choices,
                                              const std::string& help) {
  std::vector<std::string> names;
  for (const auto& choice : choices) names.push_back(choice.first);
  Option& option = AddOption(name, help + " {" + ChoiceRule(names) + "}");
  option.assign = [value, choices, names](const std::string& text) {
    for (const auto& [choice, meaning] : choices) {
      if (choice == text) {
        *value = meaning;
        return;
      }
    }
    throw std::invalid_argument("one of " + ChoiceRule(names));
  };
  option.print = [value, choices] {
    for (const auto& [choice, meaning] : choices) {
      if (meaning == *value) return choice;
    }
    return std::string();
  };
  option.default_text = option.print();
  return option;
}

}  // namespace colmap_ext

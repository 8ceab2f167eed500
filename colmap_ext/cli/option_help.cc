#include "colmap_ext/cli/option_help.h"

#include <unistd.h>
#include <boost/program_options.hpp>

#include <algorithm>
#include <iostream>
#include <map>
#include <utility>

#include "colmap_ext/json_file.h"
#include "colmap_ext/terminal.h"

namespace colmap_ext {
namespace {

constexpr int kNarrowestHelp = 60, kWidestHelp = 120;  // columns

JsonHelp*& HelpOfThread() {
  thread_local JsonHelp* help = nullptr;
  return help;
}

const char* NameOf(phi::Option::Type type) {
  switch (type) {
    case phi::Option::Type::kBool:
      return "bool";
    case phi::Option::Type::kInteger:
      return "integer";
    case phi::Option::Type::kNumber:
      return "number";
    case phi::Option::Type::kText:
      return "text";
    case phi::Option::Type::kPath:
      return "path";
    case phi::Option::Type::kChoice:
      return "choice";
  }
  return "";
}

}  // namespace

JsonHelp::JsonHelp() : before_(std::exchange(HelpOfThread(), this)) {}
JsonHelp::~JsonHelp() { HelpOfThread() = before_; }

std::string GroupOf(const std::string& name) {
  const std::size_t dot = name.find('.');
  return dot == std::string::npos ? "" : name.substr(0, dot);
}

void PrintJsonHelp(const CommandDescription& description) {
  nlohmann::ordered_json options = nlohmann::ordered_json::array();
  for (const phi::Option& option : description.options) {
    if (option.is_for_developers()) continue;
    options.push_back({{"name", option.name()},
                       {"type", NameOf(option.type())},
                       {"help", option.help()},
                       {"unit", option.unit()},
                       {"default", option.default_text()},
                       {"value", option.Text()},
                       {"choices", option.choices()},
                       {"required", option.required()}});
  }
  const nlohmann::ordered_json json = {{"command", description.command}, {"summary", description.summary}, {"options", options}};
  if (JsonHelp* const help = HelpOfThread(); help != nullptr) {
    help->text_ = DumpJson(json, 1);
  } else {
    std::cout << DumpJson(json, 1) << std::endl;
  }
}

void PrintHelp(const CommandDescription& description) {
  const int columns = std::clamp(TerminalColumns(STDOUT_FILENO), kNarrowestHelp, kWidestHelp);
  const int description_columns = columns * 5 / 8;  // long names have lines of their own
  std::map<std::string, boost::program_options::options_description> groups;
  for (const phi::Option& option : description.options) {
    if (option.is_for_developers()) continue;
    const std::string group = GroupOf(option.name());
    auto it = groups.try_emplace(group, group.empty() ? "Options" : group, columns, description_columns).first;
    auto* value = boost::program_options::value<std::string>();
    if (!option.default_text().empty()) value->default_value(option.default_text());
    std::string help = option.help();
    if (!option.unit().empty()) help += " [" + option.unit() + "]";
    if (option.required()) help += " (required)";
    it->second.add_options()(option.name().c_str(), value, help.c_str());
  }
  std::cout << WrapText("phimvs " + description.command + ": " + description.summary, columns, 2) << "\n";
  for (const auto& [group, lines] : groups) std::cout << "\n" << lines;
  std::string only_colmap = " ";
  for (const std::string& name : description.only_colmap) only_colmap += " --" + name;
  std::cout << "\nCOLMAP's options without a counterpart are accepted and have no effect:\n"
            << WrapText(only_colmap, columns, 2) << std::endl;
}

}  // namespace colmap_ext

// The commands of the command line, run in this process.
#include <nanobind/nanobind.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <iostream>
#include <string>
#include <vector>

#include "colmap_ext/build_info.h"
#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/option_help.h"
#include "colmap_ext/text_stream.h"
#include "phi/base/error.h"
#include "python/bindings/module.h"
#include "python/bindings/supervised.h"
#include "python/bindings/text_caster.h"

namespace nb = nanobind;

namespace phimvs_python {
namespace {

// What the commands print, tables that is, goes into a text.
class CapturedOutput {
 public:
  CapturedOutput() : before_(std::cout.rdbuf(text_.rdbuf())) {}
  ~CapturedOutput() { std::cout.rdbuf(before_); }
  CapturedOutput(const CapturedOutput&) = delete;
  CapturedOutput& operator=(const CapturedOutput&) = delete;
  std::string text() const { return text_.str(); }

 private:
  colmap_ext::TextOutput text_;
  std::streambuf* before_;
};

// The exit code and what the command printed.
std::pair<int, std::string> RunCommand(const std::string& name, const std::vector<std::string>& arguments,
                                       const Listeners& listeners) {
  const colmap_ext::Command* command = colmap_ext::FindCommand(name);
  if (command == nullptr) throw phi::UsageError("there is no command '" + name + "'");
  std::vector<std::string> words = {name};
  words.insert(words.end(), arguments.begin(), arguments.end());
  words.insert(words.end(), {"--log_level", listeners.debug ? "3" : "2"});
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  int code = 0;
  std::string printed;
  RunSupervised(listeners, [&] {
    const CapturedOutput output;
    code = command->run(static_cast<int>(argv.size()), argv.data());
    printed = output.text();
  });
  return {code, printed};
}

// A command and its options as JSON, once the options among `arguments` have passed their checks. Waits for no run: options
// are made and set while one is under way, also by its callables.
std::string DescribeCommand(const std::string& name, std::vector<std::string> arguments) {
  const colmap_ext::Command* command = colmap_ext::FindCommand(name);
  if (command == nullptr) throw phi::UsageError("there is no command '" + name + "'");
  arguments.insert(arguments.begin(), name);
  arguments.emplace_back("--help_json");
  std::vector<char*> argv;
  for (std::string& word : arguments) argv.push_back(word.data());
  const colmap_ext::JsonHelp help;
  command->run(static_cast<int>(argv.size()), argv.data());
  return help.text();
}

// The program itself, for the script that the package installs.
int RunProgram(std::vector<std::string> words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  const nb::gil_scoped_release release;
  return colmap_ext::RunMain(static_cast<int>(argv.size()), argv.data());
}

}  // namespace

void BindCommands(nb::module_& module) {
  module.def("run_command", &RunCommand);
  module.def("describe_command", &DescribeCommand);
  module.def("main", &RunProgram);
  module.def("version_text", &colmap_ext::VersionText,
             "Version, commit, CUDA architectures, and the devices of this machine that work.");
  module.def("cancel", &CancelRun,
             "Makes the call that is under way in another thread end with phimvs.Cancelled; finished maps are kept.");
}

}  // namespace phimvs_python

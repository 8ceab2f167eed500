#include "tests/support/run_program.h"

#include <sys/wait.h>
#include <cstdlib>
#include <filesystem>

#include "tests/support/temporary_folder.h"

namespace test_support {
namespace {

std::string Quoted(const std::string& word) {
  std::string quoted = "'";
  for (char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace

ProgramResult RunProgram(const std::vector<std::string>& command,
                         const std::vector<std::string>& environment) {
  const TemporaryFolder folder;
  std::string line = "env";
  for (const std::string& entry : environment) line += " " + Quoted(entry);
  for (const std::string& word : command) line += " " + Quoted(word);
  line +=
      " >" + Quoted((folder / "out").string()) + " 2>" + Quoted((folder / "err").string()) + " </dev/null";
  const int status = std::system(line.c_str());
  ProgramResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  result.output = ReadBytes(folder / "out");
  result.errors = ReadBytes(folder / "err");
  return result;
}

bool HasProgram(const std::string& name) {
  return RunProgram({"sh", "-c", "command -v \"$0\"", name}).exit_code == 0;
}

}  // namespace test_support

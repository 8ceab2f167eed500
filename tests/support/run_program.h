// Runs a program to its end, as a shell would.
#pragma once

#include <string>
#include <vector>

namespace test_support {

struct ProgramResult {
  int exit_code = -1;
  std::string output;  // standard output
  std::string errors;  // standard error
};

// `environment`: "NAME=value" entries on top of this process's. The program is looked up on PATH unless it
// has a slash.
ProgramResult RunProgram(const std::vector<std::string>& command,
                         const std::vector<std::string>& environment = {});

// Whether the program can be started at all.
bool HasProgram(const std::string& name);

}  // namespace test_support

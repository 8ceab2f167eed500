// Runs a command of the program on a workspace.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/run_program.h"

namespace test_support {

// `phimvs COMMAND --workspace_path WORKSPACE` on the CPU backend, which is there on every machine.
inline ProgramResult RunOnWorkspace(const std::string& command, const std::filesystem::path& workspace,
                                    const std::vector<std::string>& options = {}) {
  std::vector<std::string> words{PHIMVS_BINARY,         command, "--workspace_path", workspace.string(),
                                 "--PhiStereo.backend", "cpu"};
  words.insert(words.end(), options.begin(), options.end());
  return RunProgram(words);
}

}  // namespace test_support

// Runs a program while the test watches it: sends it signals, or shows it a terminal.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace test_support {

struct WatchedResult {
  int exit_code = -1;  // 128 + signal when a signal ended it
  std::string out, err;
};

struct WatchOptions {
  bool terminal = false;  // stderr is a terminal (and stdout with it: all output is in `err`)
  unsigned short columns = 80;  // of the terminal
  // Called again and again while the program runs; may send it signals.
  std::function<void(pid_t)> while_running = {};
};

WatchedResult RunWatchedProgram(const std::filesystem::path& binary,
                                const std::vector<std::string>& arguments, const WatchOptions& options = {});

}  // namespace test_support

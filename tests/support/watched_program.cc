#include "tests/support/watched_program.h"

#include <fcntl.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>

#include "tests/support/temporary_folder.h"

namespace test_support {
namespace {

constexpr useconds_t kPollMicroseconds = 500;

[[noreturn]] void Execute(const std::filesystem::path& binary, const std::vector<std::string>& arguments) {
  std::vector<char*> argv = {const_cast<char*>(binary.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  execv(binary.c_str(), argv.data());
  _exit(127);
}

void RedirectTo(const std::filesystem::path& path, int descriptor) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  dup2(file, descriptor);
  close(file);
}

// Appends what the terminal has shown so far.
void ReadTerminal(int terminal, std::string* text) {
  char buffer[4096];
  for (ssize_t n = read(terminal, buffer, sizeof(buffer)); n > 0;
       n = read(terminal, buffer, sizeof(buffer))) {
    text->append(buffer, static_cast<std::size_t>(n));
  }
}

}  // namespace

WatchedResult RunWatchedProgram(const std::filesystem::path& binary,
                                const std::vector<std::string>& arguments, const WatchOptions& options) {
  const TemporaryFolder folder;
  WatchedResult result;
  int terminal = -1;
  const winsize size{.ws_row = 24, .ws_col = options.columns, .ws_xpixel = 0, .ws_ypixel = 0};
  const pid_t pid = options.terminal ? forkpty(&terminal, nullptr, nullptr, &size) : fork();
  if (pid < 0) throw std::runtime_error("cannot fork");
  if (pid == 0) {
    if (options.terminal) {
      setenv("TERM", "xterm", 1);
    } else {
      RedirectTo(folder / "out", STDOUT_FILENO);
      RedirectTo(folder / "err", STDERR_FILENO);
    }
    Execute(binary, arguments);
  }
  if (options.terminal) fcntl(terminal, F_SETFL, O_NONBLOCK);
  int status = 0;
  while (waitpid(pid, &status, WNOHANG) == 0) {
    if (options.while_running) options.while_running(pid);
    if (options.terminal) ReadTerminal(terminal, &result.err);
    usleep(kPollMicroseconds);
  }
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  if (options.terminal) {
    ReadTerminal(terminal, &result.err);
    close(terminal);
  } else {
    // A process that was killed at once has not made them.
    if (std::filesystem::exists(folder / "out")) result.out = ReadBytes(folder / "out");
    if (std::filesystem::exists(folder / "err")) result.err = ReadBytes(folder / "err");
  }
  return result;
}

}  // namespace test_support

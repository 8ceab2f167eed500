// phimvs COMMAND [--option value]...: finds the command, and turns errors and signals into exit codes.
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/suggestion.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace {

// What a program returns that found itself in error (sysexits.h calls it EX_SOFTWARE).
constexpr int kInternalError = 70;

volatile std::sig_atomic_t g_signal = 0;

void OnSignal(int signal) {
  g_signal = signal;
  phi::CancellationFlag().store(true);
}

// The first signal asks for a clean stop; the second one ends the process at once.
void CatchSignals() {
  struct sigaction action = {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESETHAND;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

void PrintUsage(std::ostream& out) {
  out << "phimvs " PHIMVS_VERSION
         ": dense multi-view stereo for COLMAP workspaces\n\n"
         "usage: phimvs COMMAND [--option value]...\n\n";
  for (const auto& command : colmap_ext::Commands()) {
    out << "  " << command.name << std::string(command.name.size() < 20 ? 20 - command.name.size() : 1, ' ')
        << command.summary << "\n";
  }
  out << "  help                this text; `phimvs help COMMAND` lists a command's options\n"
         "  version             the version\n\n"
         "Exit codes: 0 done, 1 usage, 2 bad input, 3 out of memory or disk, 4 some images failed, 5 no device.\n";
}

void ReportUnknownCommand(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& command : colmap_ext::Commands()) names.emplace_back(command.name);
  phi::LogError("there is no command '" + name + "'" + colmap_ext::SuggestName(name, names));
}

int CodeOf(const std::system_error& error) {
  switch (error.code().value()) {
    case ENOSPC:
    case EDQUOT:
    case ENOMEM:
    case EMFILE:
    case ENFILE:
      return static_cast<int>(phi::ExitCode::kOutOfResources);
    default:
      return static_cast<int>(phi::ExitCode::kBadInput);
  }
}

int RunCommand(const colmap_ext::Command& command, int argc, char** argv) {
  try {
    return command.run(argc, argv);
  } catch (const phi::Cancelled&) {
    phi::LogWarning("stopped on request");
    return 128 + (g_signal ? g_signal : SIGINT);
  } catch (const phi::Error& error) {
    phi::LogError(error.what());
    return static_cast<int>(error.code());
  } catch (const std::bad_alloc&) {
    phi::LogError(
        "out of memory; a lower --PatchMatchStereo.cache_size or --PatchMatchStereo.max_image_size needs "
        "less");
    return static_cast<int>(phi::ExitCode::kOutOfResources);
  } catch (const std::system_error& error) {
    phi::LogError(error.what());
    return CodeOf(error);
  } catch (const std::exception& error) {
    phi::LogError(std::string("internal error, please report it: ") + error.what());
    return kInternalError;
  }
}

}  // namespace

int main(int argc, char** argv) {
  CatchSignals();
  const std::string name = argc > 1 ? argv[1] : "";
  if (name == "version" || name == "--version") {
    std::cout << "phimvs " PHIMVS_VERSION << std::endl;
    return EXIT_SUCCESS;
  }
  const bool help = name == "help" || name == "--help" || name == "-h";
  if (help && argc == 2) {
    PrintUsage(std::cout);
    return EXIT_SUCCESS;
  }
  const std::string command_name = help ? argv[2] : name;
  const colmap_ext::Command* command = colmap_ext::FindCommand(command_name);
  if (!command) {
    if (!command_name.empty()) ReportUnknownCommand(command_name);
    PrintUsage(std::cerr);
    return static_cast<int>(phi::ExitCode::kUsage);
  }
  if (help) {
    char option[] = "--help";
    char* words[] = {argv[2], option};
    return RunCommand(*command, 2, words);
  }
  return RunCommand(*command, argc - 1, argv + 1);
}

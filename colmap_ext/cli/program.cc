// phimvs COMMAND [--option value]...: finds the command, and turns errors and signals into exit codes.
#include <fcntl.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "colmap_ext/build_info.h"
#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/suggestion.h"
#include "colmap_ext/processor_limit.h"
#include "colmap_ext/terminal.h"
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

// A file that is opened gets the lowest free number. Where the caller closed a standard stream (2>&-), that would be the
// stream's, and the log would go into the file. What is opened here refuses what the closed stream would have refused.
bool KeepStandardStreams() {
  for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    if (::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) != stream) return false;
  }
  return true;
}

// The first signal asks for a clean stop; the second one ends the process at once. A file beyond `ulimit -f` is an error
// of the call that writes it.
void CatchSignals() {
  struct sigaction action = {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESETHAND;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGXFSZ, SIG_IGN);
}

void PrintCommand(std::string_view name, std::string_view summary, int columns, std::ostream& out) {
  constexpr int kNameColumns = 22;
  std::string line = "  " + std::string(name);
  line.resize(std::max<std::size_t>(line.size() + 1, kNameColumns), ' ');
  out << line << colmap_ext::WrapText(std::string(summary), columns - kNameColumns, kNameColumns) << "\n";
}

void PrintUsage(int stream, std::ostream& out) {
  const int columns = std::max(colmap_ext::TerminalColumns(stream), 40);
  out << "phimvs " PHIMVS_VERSION
         ": dense multi-view stereo for COLMAP workspaces\n\n"
         "usage: phimvs COMMAND [--option value]...\n\n";
  for (const auto& command : colmap_ext::Commands())
    PrintCommand(command.name, command.summary, columns, out);
  PrintCommand("help", "this text; `phimvs help COMMAND` lists a command's options", columns, out);
  PrintCommand("version", "version, commit, CUDA architectures, devices", columns, out);
  out << "\n"
      << colmap_ext::WrapText(
             "Exit codes: 0 done, 1 usage, 2 bad input, 3 out of memory or disk, or a GPU failed, 4 some images failed, "
             "5 no GPU, 6 waits for other shards: run again later, 70 an error in phimvs, 130 and 143 stopped.",
             columns, 0)
      << "\n";
}

// Of those that stand before or behind ours.
constexpr std::string_view kColmapCommands[] = {
    "automatic_reconstructor", "bundle_adjuster", "delaunay_mesher", "exhaustive_matcher", "feature_extractor",
    "global_mapper", "gui", "hierarchical_mapper", "image_undistorter", "mapper", "model_aligner", "model_converter",
    "point_triangulator", "poisson_mesher", "sequential_matcher", "spatial_matcher", "vocab_tree_matcher"};

// name: empty where none was given.
void ReportUnknownCommand(const std::string& name) {
  if (std::find(std::begin(kColmapCommands), std::end(kColmapCommands), name) != std::end(kColmapCommands)) {
    phi::LogError("'" + name + "' is a command of COLMAP: run `colmap " + name + "`");
    return;
  }
  if (!name.empty()) {
    std::vector<std::string> names;
    for (const auto& command : colmap_ext::Commands()) names.emplace_back(command.name);
    phi::LogError("there is no command '" + name + "'" + colmap_ext::SuggestName(name, names));
  }
  PrintUsage(STDERR_FILENO, std::cerr);
}

int CodeOf(const std::system_error& error) {
  switch (error.code().value()) {
    case ENOSPC:
    case EDQUOT:
    case ENOMEM:
    case EMFILE:
    case ENFILE:
    case EAGAIN:
      return static_cast<int>(phi::ExitCode::kOutOfResources);
    default:
      return static_cast<int>(phi::ExitCode::kBadInput);
  }
}

constexpr char kLimitsAdvice[] = "; end other programs of this user, or raise its limits (ulimit -a)";

// The options of the command that need memory.
std::string MemoryAdvice(std::string_view command) {
  if (command == "patch_match_stereo" || command == "hole_filler" || command == "dense") {
    return "; a lower --PatchMatchStereo.cache_size or --PatchMatchStereo.max_image_size needs less";
  }
  if (command == "stereo_fusion") return "; a lower --PhiFusion.max_memory_gb needs less";
  if (command == "evaluate") return "; a lower --memory needs less, and so does a thinner cloud or mesh";
  return "; end other programs, or give it less to do";
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
    phi::LogError("out of memory" + MemoryAdvice(command.name));
    return static_cast<int>(phi::ExitCode::kOutOfResources);
  } catch (const std::filesystem::filesystem_error& error) {
    phi::LogError(error.path1().string() + ": " + error.code().message() +
                  "; check that it is there and that this user may read and write it");
    return CodeOf(error);
  } catch (const std::system_error& error) {
    phi::LogError(error.what() + std::string(kLimitsAdvice));
    return CodeOf(error);
  } catch (const std::exception& error) {
    // oneTBB has no type of its own for it.
    if (std::string_view(error.what()).starts_with("pthread_create has failed")) {
      phi::LogError(error.what() + std::string(kLimitsAdvice));
      return static_cast<int>(phi::ExitCode::kOutOfResources);
    }
    phi::LogError(std::string("internal error, please report it: ") + error.what());
    return kInternalError;
  }
}

bool IsHelp(std::string_view word) { return word == "help" || word == "--help" || word == "-h"; }

int RunProgram(int argc, char** argv) {
  const std::string name = argc > 1 ? argv[1] : "";
  if (name == "version" || name == "--version") {
    std::cout << colmap_ext::VersionText();
    return EXIT_SUCCESS;
  }
  const bool help = IsHelp(name);
  if (help && (argc == 2 || IsHelp(argv[2]))) {
    PrintUsage(STDOUT_FILENO, std::cout);
    return EXIT_SUCCESS;
  }
  const std::string command_name = help ? argv[2] : name;
  const colmap_ext::Command* command = colmap_ext::FindCommand(command_name);
  if (!command) {
    ReportUnknownCommand(command_name);
    return static_cast<int>(phi::ExitCode::kUsage);
  }
  if (help) {
    char option[] = "--help";
    char* words[] = {argv[2], option};
    return RunCommand(*command, 2, words);
  }
  std::optional<tbb::global_control> limit;  // TBB itself knows of cores, not of a container's share of their time
  if (const int num_processors = colmap_ext::NumProcessors(); num_processors < tbb::info::default_concurrency())
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(num_processors));
  return RunCommand(*command, argc - 1, argv + 1);
}

}  // namespace

namespace colmap_ext {

int RunMain(int argc, char** argv) {
  if (!KeepStandardStreams()) return static_cast<int>(phi::ExitCode::kOutOfResources);
  CatchSignals();
  const int code = RunProgram(argc, argv);
  // Tables and lists go to the standard output: on a full disk they are lost.
  if (std::cout.flush()) return code;
  phi::LogError("the standard output cannot be written: free some space, or send it elsewhere");
  return code == EXIT_SUCCESS ? static_cast<int>(phi::ExitCode::kOutOfResources) : code;
}

}  // namespace colmap_ext

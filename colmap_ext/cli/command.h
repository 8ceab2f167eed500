// The table of commands. A command is one file in this folder, one declaration below and one line in
// commands.cc.
#pragma once

#include <span>
#include <string_view>

namespace colmap_ext {

// argv[0] is the command's own name. Returns the exit code; errors are thrown (phi::Error) and reported by
// main.
using CommandFunction = int (*)(int argc, char** argv);

struct Command {
  std::string_view name;
  std::string_view summary;  // one line for `phimvs help`
  CommandFunction run;
};

// The whole program: phimvs COMMAND [--option value]... Catches signals, prints errors, returns the exit code.
int RunMain(int argc, char** argv);

std::span<const Command> Commands();
const Command* FindCommand(std::string_view name);  // null when there is none

// One function per command, defined in the file of the same name.
int RunPatchMatchStereo(int argc, char** argv);
int RunHoleFiller(int argc, char** argv);
int RunStereoFusion(int argc, char** argv);
int RunStatusCommand(int argc, char** argv);
int RunWorkspaceChecker(int argc, char** argv);
int RunEvaluate(int argc, char** argv);
int RunMakeScene(int argc, char** argv);
int RunReport(int argc, char** argv);
int RunDense(int argc, char** argv);
int RunMapInspector(int argc, char** argv);
int RunSelfTest(int argc, char** argv);

}  // namespace colmap_ext

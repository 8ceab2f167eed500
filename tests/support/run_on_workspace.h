// Runs the program's commands on a workspace, and reads what they left.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/support/run_program.h"

namespace test_support {

// `phimvs COMMAND --workspace_path WORKSPACE` on the CPU backend, which is there on every machine.
ProgramResult RunOnWorkspace(const std::string& command, const std::filesystem::path& workspace,
                             const std::vector<std::string>& options = {});

// `phimvs make_scene` into FOLDER/room, images of so many pixels, without a loss by JPEG; EXPECTs that it succeeds. The
// workspace is FOLDER/room/dense.
void MakeRoom(const std::filesystem::path& folder, int width, int height, int num_views);

// Content of all maps and masks below stereo/, by their paths in the workspace.
std::map<std::string, std::string> ReadMaps(const std::filesystem::path& workspace);

}  // namespace test_support

// Where the workspace is that a user means.
#pragma once

#include <filesystem>

namespace colmap_ext {

// The folder itself where it is a workspace, else the one workspace below it (dense, dense/0 or 0), which is logged.
// Unchanged where there is none; Workspace then says what is missing. Throws phi::InputError where there are several.
std::filesystem::path FindWorkspaceFolder(const std::filesystem::path& path);

}  // namespace colmap_ext

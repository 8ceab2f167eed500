// stereo/fusion.cfg: the images to fuse, a name a line. Lines that start with # are comments.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/problem_list.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Indices into Workspace::views(), in the file's order. `config_path` empty: the workspace's own file. Throws
// phi::InputError naming file and line, or, with `problems`, lists what can be stepped over.
std::vector<int> ReadFusionConfig(const Workspace& workspace, const std::filesystem::path& config_path = {},
                                  ProblemList* problems = nullptr);

void WriteFusionConfig(const std::filesystem::path& path, const std::vector<std::string>& image_names);

}  // namespace colmap_ext

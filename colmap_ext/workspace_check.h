// Looks at everything that dense stereo reads from a workspace, and lists all that is wrong with it at once.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "colmap_ext/problem_list.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

struct WorkspaceReport {
  ProblemList errors;    // stop a run, or an image of it
  ProblemList warnings;  // make results worse, or waste space
  std::size_t num_images = 0, num_points = 0, num_reference_images = 0;
};

// `config_path` empty: the workspace's own patch-match.cfg. `fusion_mask_path` empty: fusion has no masks. Throws phi::UsageError
// for a wrong option only.
WorkspaceReport CheckWorkspace(const WorkspaceOptions& options,
                               const std::filesystem::path& config_path = {},
                               const std::filesystem::path& fusion_mask_path = {});

}  // namespace colmap_ext

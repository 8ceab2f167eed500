// stereo/patch-match.cfg: which images to estimate, and from which source images. Pairs of lines: the
// reference image's name, then `__all__`, `__auto__, N` or names parted by commas. Lines that start with #
// are comments.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/problem_list.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// One reference image and its sources. Images are indices into Workspace::views().
struct PatchMatchProblem {
  int reference = -1;
  // > 0: select at most so many source images, and `sources` is empty.
  int max_automatic_sources = 0;
  // To be taken whole: in the file's order, or (`__all__`) the model's.
  std::vector<int> sources;
};

// In the file's order. `config_path` (--config_path) empty: the workspace's own file. Throws phi::InputError
// naming file and line, or, with `problems`, lists what can be stepped over.
std::vector<PatchMatchProblem> ReadPatchMatchConfig(const Workspace& workspace,
                                                    const std::filesystem::path& config_path = {},
                                                    ProblemList* problems = nullptr);

// Every image with `__auto__, max_num_sources`, as the undistorter writes it.
void WritePatchMatchConfig(const std::filesystem::path& path, const std::vector<std::string>& image_names,
                           int max_num_sources);

}  // namespace colmap_ext

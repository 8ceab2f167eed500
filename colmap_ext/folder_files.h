// What lies in a folder, and in those that links lead to: parts of a workspace are often on another disk.
#pragma once

#include <filesystem>
#include <vector>

namespace colmap_ext {

enum class HiddenFiles { kLeftOut, kIncluded };

// The regular files below it, as paths from it, sorted. Links are followed, but those to a folder that they lie in. Folders that
// cannot be read are left out, with a warning.
std::vector<std::filesystem::path> FilesBelow(const std::filesystem::path& folder,
                                              HiddenFiles hidden = HiddenFiles::kLeftOut);

}  // namespace colmap_ext

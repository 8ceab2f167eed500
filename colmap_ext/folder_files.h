// What lies in a folder, for messages about files that are not where they should be.
#pragma once

#include <filesystem>
#include <vector>

namespace colmap_ext {

// The regular files below it, as paths from it, sorted. Hidden ones are left out, and whatever cannot be read.
std::vector<std::filesystem::path> FilesBelow(const std::filesystem::path& folder);

}  // namespace colmap_ext

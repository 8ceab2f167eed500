// COLMAP's project files (.ini): `name=value`, below a [group] `group.name`; # begins a comment.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace colmap_ext {

struct ProjectEntry {
  std::string name, value;
  int line = 0;  // from 1
};

// Throws phi::InputError naming the file and, for a line that is none of these, its number.
std::vector<ProjectEntry> ReadProjectFile(const std::filesystem::path& path);

}  // namespace colmap_ext

// Opening files that users name.
#pragma once

#include <filesystem>
#include <fstream>

namespace colmap_ext {

// A stream of the file's bytes; a failed one where there is no regular file that can be opened, and its caller says so. A
// pipe is none: it would be waited for, and most readers go through a file twice. Throws phi::ResourceError where the
// file is not at fault: too many are open.
std::ifstream OpenRegularFile(const std::filesystem::path& path);
// The same of a file that must be there. Throws phi::InputError that names it and says why it cannot be opened.
std::ifstream OpenNeededFile(const std::filesystem::path& path);

}  // namespace colmap_ext

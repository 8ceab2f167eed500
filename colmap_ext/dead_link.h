// Links to what is not there: a disk that is not mounted.
#pragma once

#include <filesystem>
#include <string>

namespace colmap_ext {

// Of the path, or of the innermost folder that it lies in and that is such a link: "'NAME' is a link to TARGET, which cannot be
// reached; mount or restore that". Empty where there is none.
std::string DescribeDeadLink(const std::filesystem::path& path);

// Of what lies in a workspace's folder `stereo`, and that folder itself: maps could not be written, which would show after the work.
// Throws phi::InputError.
void RequireReachable(const std::filesystem::path& stereo_folder);

}  // namespace colmap_ext

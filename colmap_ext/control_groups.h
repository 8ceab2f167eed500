// The control groups that this process is in: with them a container, systemd or a cluster's scheduler limits what it may use below
// what the machine has.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace colmap_ext {

enum class GroupVersion { kOne, kTwo };  // of Linux's control groups; their files have different names

// function(folder, version) for the groups of a controller ("memory", "cpu") that the process is in, for those that these are in, and
// for what a container sees as the root. A group may come twice; a folder or its files may not be there. `root`: holds proc/ and sys/.
void ForControlGroups(const std::filesystem::path& root, std::string_view controller,
                      const std::function<void(const std::filesystem::path& folder, GroupVersion version)>& function);

}  // namespace colmap_ext

// How many of the machine's cores this process may keep busy.
#pragma once

#include <filesystem>
#include <optional>

namespace colmap_ext {

// The least share of processor time, in cores, of the process's control groups and of those that they are in; nullopt: none has a
// limit. `root`: holds proc/ and sys/.
std::optional<double> ControlGroupProcessorLimit(const std::filesystem::path& root = "/");

// The cores that the process may run on, or the limit, rounded up, where that is less; at least 1. With more threads than processor
// time the kernel stops all of them for a part of each period.
int NumProcessors();

}  // namespace colmap_ext

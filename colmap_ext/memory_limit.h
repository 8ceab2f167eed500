// What memory this process may use, which a container, systemd or a cluster's scheduler limits below the machine's.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace colmap_ext {

// The least limit in bytes of the process's control groups and of those that they are in; nullopt: none has one. `root`: holds
// proc/ and sys/.
std::optional<std::int64_t> ControlGroupMemoryLimit(const std::filesystem::path& root = "/");

// The machine's memory, or the limit where that is less.
std::int64_t AvailableHostBytes();

}  // namespace colmap_ext

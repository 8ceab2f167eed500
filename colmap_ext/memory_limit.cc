#include "colmap_ext/memory_limit.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "colmap_ext/control_groups.h"

namespace colmap_ext {

std::optional<std::int64_t> ControlGroupMemoryLimit(const std::filesystem::path& root) {
  std::optional<std::int64_t> least;
  ForControlGroups(root, "memory", [&](const std::filesystem::path& folder, GroupVersion version) {
    std::int64_t limit = 0;
    std::ifstream file(folder / (version == GroupVersion::kOne ? "memory.limit_in_bytes" : "memory.max"));
    // A file that is not there, and "max", which is no number, limit nothing.
    if (file >> limit && limit > 0) least = std::min(least.value_or(limit), limit);
  });
  return least;
}

std::int64_t AvailableHostBytes() {
  const std::int64_t num_bytes = static_cast<std::int64_t>(::sysconf(_SC_PHYS_PAGES)) * ::sysconf(_SC_PAGE_SIZE);
  return std::min(num_bytes, ControlGroupMemoryLimit().value_or(num_bytes));
}

}  // namespace colmap_ext

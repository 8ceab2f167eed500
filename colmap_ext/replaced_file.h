// Results that take the place of an earlier one, and of nothing else.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace colmap_ext {

// Throws phi::UsageError where a file is there that does not begin as `what` does: two paths were mixed up, and what it holds would be
// lost. An empty file may be replaced.
void RequireReplaceable(const std::filesystem::path& path, std::string_view begin, const std::string& what);

}  // namespace colmap_ext

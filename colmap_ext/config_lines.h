// The lines of COLMAP's small configuration files (patch-match.cfg, fusion.cfg).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "phi/base/message.h"

namespace colmap_ext {

struct ConfigLine {
  int number = 0;    // from 1
  std::string text;  // without surrounding white space; not empty, no comment
};

// What editors of Windows put before a text.
inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

// Throws phi::InputError when the file cannot be read, or is no UTF-8.
std::vector<ConfigLine> ReadConfigLines(const std::filesystem::path& path);

// Throws phi::InputError that says so where `text`, of the file or of its beginning, is UTF-16 or UTF-32, as Windows' editor and
// shell may save it. Read as bytes, it would break off in the middle of a message.
void RequireUtf8(const std::filesystem::path& path, std::string_view text);

std::string_view Trim(std::string_view text);

// "PATH: line N: ".
phi::Message LineText(const std::filesystem::path& path, int number);

}  // namespace colmap_ext

// printf's formats into strings.
#pragma once

#include <cstdio>
#include <string>

namespace colmap_ext {

// Longer texts are cut.
template <typename... Values>
std::string FormatText(const char* format, Values... values) {
  char text[512];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

}  // namespace colmap_ext

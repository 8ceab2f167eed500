// Texts by printf's formats, of sizes, and in small letters.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <string>

#include "phi/base/c_locale.h"

namespace colmap_ext {

// Longer texts are cut. Decimal points, whatever the locale.
template <typename... Values>
std::string FormatText(const char* format, Values... values) {
  const phi::CLocaleScope points_not_commas;
  char text[512];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

// "640x480".
template <typename Number>
std::string SizeText(Number width, Number height) { return std::to_string(width) + "x" + std::to_string(height); }

// Of ASCII: names and suffixes of files, words of options.
inline std::string Lowercase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace colmap_ext

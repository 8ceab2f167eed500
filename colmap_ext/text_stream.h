// Streams of text whose numbers are those of files, without decimal commas or grouped digits, whatever std::locale::global a
// program that calls the library has set.
#pragma once

#include <locale>
#include <sstream>
#include <string>

namespace colmap_ext {

class TextInput : public std::istringstream {
 public:
  explicit TextInput(const std::string& text = "") : std::istringstream(text) { imbue(std::locale::classic()); }
};

class TextOutput : public std::ostringstream {
 public:
  TextOutput() { imbue(std::locale::classic()); }
};

}  // namespace colmap_ext

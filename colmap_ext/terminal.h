// How wide a terminal is, and text that fits it.
#pragma once

#include <string>

namespace colmap_ext {

// Columns of the terminal that the open file `stream` is now; 80 where it is none or does not tell.
int TerminalColumns(int stream);

// The words of `text` in lines of at most `columns`, each after the first behind `indent` spaces. `text` may begin with
// spaces; a word that is too long gets a line of its own.
std::string WrapText(const std::string& text, int columns, int indent);

}  // namespace colmap_ext

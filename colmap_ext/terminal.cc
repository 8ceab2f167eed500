#include "colmap_ext/terminal.h"

#include <sys/ioctl.h>

#include <sstream>

namespace colmap_ext {

int TerminalColumns(int stream) {
  constexpr int kUsual = 80;
  winsize size = {};
  if (ioctl(stream, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return kUsual;
}

std::string WrapText(const std::string& text, int columns, int indent) {
  std::string wrapped = text.substr(0, text.find_first_not_of(' '));
  std::size_t length = wrapped.size();
  bool is_first = true;  // word of its line
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!is_first && length + 1 + word.size() > static_cast<std::size_t>(columns)) {
      wrapped += "\n" + std::string(indent, ' ');
      length = indent;
      is_first = true;
    }
    wrapped += (is_first ? "" : " ") + word;
    length += word.size() + (is_first ? 0 : 1);
    is_first = false;
  }
  return wrapped;
}

}  // namespace colmap_ext

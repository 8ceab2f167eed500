#include "colmap_ext/cli/project_file.h"

#include <string_view>

#include "colmap_ext/config_lines.h"
#include "colmap_ext/input_file.h"
#include "phi/base/error.h"

namespace colmap_ext {

std::vector<ProjectEntry> ReadProjectFile(const std::filesystem::path& path) {
  if (!OpenRegularFile(path)) {
    throw phi::InputError("--project_path: " + phi::AboutFile(path) + " is no file that can be read");
  }
  std::vector<ProjectEntry> entries;
  std::string group;
  for (const ConfigLine& line : ReadConfigLines(path)) {
    const std::string_view text = Trim(std::string_view(line.text).substr(0, line.text.find('#')));
    if (text.starts_with('[') && text.ends_with(']')) {
      group = Trim(text.substr(1, text.size() - 2));
      if (!group.empty()) group += '.';
      continue;
    }
    const std::size_t equals = text.find('=');
    const std::string_view name = Trim(text.substr(0, equals));
    if (equals == std::string_view::npos || name.empty()) {
      throw phi::InputError("--project_path: " + LineText(path, line.number) +
                            "neither a [group], nor NAME=VALUE, nor a comment (#)");
    }
    entries.push_back({group + std::string(name), std::string(Trim(text.substr(equals + 1))), line.number});
  }
  return entries;
}

}  // namespace colmap_ext

#include "colmap_ext/config_lines.h"

#include <fstream>

#include "colmap_ext/input_file.h"
#include "phi/base/error.h"

namespace colmap_ext {

std::string_view Trim(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpace) + 1 - begin);
}

phi::Message LineText(const std::filesystem::path& path, int number) {
  return phi::AboutFile(path) + ": line " + std::to_string(number) + ": ";
}

void RequireUtf8(const std::filesystem::path& path, std::string_view text) {
  const bool has_other_mark = text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF");
  if (!has_other_mark && text.find('\0') == std::string_view::npos) return;
  throw phi::InputError(phi::AboutFile(path) + ": this text is in UTF-16, or no text; save it as UTF-8");
}

std::vector<ConfigLine> ReadConfigLines(const std::filesystem::path& path) {
  std::ifstream file = OpenRegularFile(path);
  if (!file) {
    throw phi::InputError(phi::AboutFile(path) +
                          ": this file is missing or cannot be opened; colmap image_undistorter writes it");
  }
  std::vector<ConfigLine> lines;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    RequireUtf8(path, line);
    std::string_view text = line;
    if (number == 1 && text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
    text = Trim(text);
    if (!text.empty() && text.front() != '#') lines.push_back({number, std::string(text)});
  }
  if (file.bad()) throw phi::InputError(phi::AboutFile(path) + ": reading broke off; check the disk");
  return lines;
}

}  // namespace colmap_ext

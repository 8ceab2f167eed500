#include "colmap_ext/input_file.h"

#include <cerrno>
#include <cstring>
#include <locale>
#include <string>
#include <system_error>

#include "phi/base/error.h"

namespace colmap_ext {

std::ifstream OpenRegularFile(const std::filesystem::path& path) {
  std::ifstream file;
  file.imbue(std::locale::classic());  // a caller may have set one of decimal commas
  std::error_code unreachable;
  if (!std::filesystem::is_regular_file(path, unreachable)) {
    file.setstate(std::ios::failbit);
    return file;
  }
  errno = 0;
  file.open(path, std::ios::binary);
  if (!file && (errno == EMFILE || errno == ENFILE || errno == ENOMEM)) {
    throw phi::ResourceError(phi::AboutFile(path) + ": cannot be opened: " + std::strerror(errno) +
                             "; raise the limit of open files (ulimit -n) or end other programs");
  }
  return file;
}

std::ifstream OpenNeededFile(const std::filesystem::path& path) {
  std::ifstream file = OpenRegularFile(path);
  if (file) return file;
  std::string why = std::strerror(errno) + std::string("; make it readable for this user");
  std::error_code unreachable;
  const std::filesystem::file_status status = std::filesystem::status(path, unreachable);
  if (!std::filesystem::exists(status)) {
    why = unreachable.message() + "; correct the path";
  } else if (!std::filesystem::is_regular_file(status)) {
    why = "it is a folder, a pipe or a device; name a file";
  }
  throw phi::InputError(phi::AboutFile(path) + ": cannot be read: " + why);
}

}  // namespace colmap_ext

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

}  // namespace colmap_ext

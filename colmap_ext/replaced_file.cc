#include "colmap_ext/replaced_file.h"

#include <fstream>

#include "colmap_ext/input_file.h"
#include "phi/base/error.h"

namespace colmap_ext {

void RequireReplaceable(const std::filesystem::path& path, std::string_view begin, const std::string& what) {
  std::ifstream file = OpenRegularFile(path);
  if (!file) return;
  std::string found(begin.size(), '\0');
  file.read(found.data(), static_cast<std::streamsize>(found.size()));
  if (file.gcount() == 0 || found == begin) return;
  throw phi::UsageError(phi::AboutFile(path) + " is no " + what + ", and would be replaced by one; choose another name, or move it away");
}

}  // namespace colmap_ext

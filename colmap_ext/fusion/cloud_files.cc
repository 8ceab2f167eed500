#include "colmap_ext/fusion/cloud_files.h"

#include <system_error>

#include "phi/base/log.h"

namespace colmap_ext {

std::filesystem::path PartOfCloud(const std::filesystem::path& cloud, const std::string& addition) {
  return std::filesystem::path(cloud).replace_filename(cloud.stem().string() + addition + cloud.extension().string());
}

void RemoveEarlierPart(const std::filesystem::path& part) {
  for (const std::filesystem::path& path : {std::filesystem::path(part.string() + ".vis"), part}) {
    std::error_code error;
    if (std::filesystem::is_directory(std::filesystem::symlink_status(path, error))) continue;
    std::filesystem::remove(path, error);
    if (error) phi::LogWarning(path.string() + " is of an earlier cloud and cannot be removed (" + error.message() + "); remove it");
  }
}

}  // namespace colmap_ext

#include "colmap_ext/missing_images.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "colmap_ext/dead_link.h"
#include "colmap_ext/folder_files.h"
#include "colmap_ext/format_text.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// What stays of a name when its folder, extension or case changes. In a model of Windows, backslashes may divide folders.
std::string Essence(const fs::path& name) {
  std::string path = name.string();
  std::replace(path.begin(), path.end(), '\\', '/');
  return Lowercase(fs::path(path).stem().string());
}

// "12" of "IMG_0012": what stays when a prefix changes.
std::string Number(const std::string& essence) {
  const std::size_t last = essence.find_last_of("0123456789");
  if (last == std::string::npos) return "";
  const std::size_t before = essence.find_last_not_of("0123456789", last);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  const std::size_t first_digit = std::min(essence.find_first_not_of('0', begin), last);
  return essence.substr(first_digit, last + 1 - first_digit);
}

// The file that the image may be, most like it first; none: npos.
std::size_t FindLookalike(const fs::path& image, const std::vector<fs::path>& files) {
  const std::string essence = Essence(image), number = Number(essence);
  const auto same_name = std::find_if(files.begin(), files.end(), [&](const fs::path& file) { return Essence(file) == essence; });
  if (same_name != files.end()) return static_cast<std::size_t>(same_name - files.begin());
  const auto same_number = std::find_if(files.begin(), files.end(), [&](const fs::path& file) {
    return !number.empty() && Number(Essence(file)) == number;
  });
  return same_number != files.end() ? static_cast<std::size_t>(same_number - files.begin()) : std::string::npos;
}

std::string WhatIsThere(const std::string& image, const std::vector<fs::path>& files) {
  const std::size_t file = FindLookalike(image, files);
  const std::string of_model = ", where the model has '" + image + "'";
  if (file != std::string::npos) return "such as '" + files[file].string() + "'" + of_model;
  return "'" + files.front().string() + "' the first" + of_model;
}

}  // namespace

phi::Message DescribeMissingImages(const Workspace& workspace) {
  const int count = static_cast<int>(workspace.views().size());
  std::error_code unreachable;  // as if it were not there
  for (int image = 0; image < count; ++image) {
    if (fs::exists(workspace.ImagePath(image), unreachable)) return "";
  }
  if (count == 0) return "";
  const fs::path folder = workspace.path() / "images";
  const phi::Message none =
      phi::AboutFile(folder) + ": none of the " + std::to_string(count) + " images of the sparse model is there";
  const bool is_folder = fs::is_directory(folder, unreachable);
  if (is_folder && ::access(folder.c_str(), R_OK | X_OK) != 0) {
    return phi::AboutFile(folder) + ": this folder of the images cannot be read; change its permissions";
  }
  const fs::path link = is_folder ? workspace.ImagePath(0) : folder;
  if (const std::string dead = DescribeDeadLink(link); !dead.empty()) {
    return none + ": " + dead + ", or run colmap image_undistorter again";
  }
  const std::vector<fs::path> files = FilesBelow(folder);
  if (files.empty()) {
    return none + (is_folder ? ", nor any other file" : ", nor the folder") +
           "; put back what colmap image_undistorter wrote, or run it again";
  }
  return none + ", but " + std::to_string(files.size()) + " other files are, " + WhatIsThere(workspace.views().front().name, files) +
         "; give them the model's names, or run colmap image_undistorter again";
}

void RequireAnImage(const Workspace& workspace) {
  if (const phi::Message problem = DescribeMissingImages(workspace); !problem.empty()) throw phi::InputError(problem);
}

}  // namespace colmap_ext

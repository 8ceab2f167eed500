#include "colmap_ext/mask_check.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <numeric>
#include <set>

#include "colmap_ext/folder_files.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// The mask's problem, or an empty string. Without a camera there is no size that it should have.
std::string MaskProblem(const Workspace& workspace, int image) {
  try {
    if (workspace.views()[image].camera.pinhole.width > 0) {
      workspace.ReadImageMask(image);
    } else if (workspace.HasImageMask(image)) {
      ReadGrayImage(workspace.ImageMaskPath(image));
    }
  } catch (const phi::InputError& error) {
    return error.what();
  }
  return "";
}

std::string DescribeStrayMasks(const Workspace& workspace, const fs::path& folder) {
  std::set<fs::path> known;
  for (const phi::SceneView& view : workspace.views()) known.insert(fs::path(view.name + ".png").lexically_normal());
  std::vector<fs::path> stray = FilesBelow(folder);
  std::erase_if(stray, [&](const fs::path& file) { return known.contains(file); });
  if (stray.empty()) return "";
  // One without a mask: its may be among them.
  const auto& views = workspace.views();
  int example = 0;
  while (example + 1 < static_cast<int>(views.size()) && workspace.HasImageMask(example)) ++example;
  const std::string count = std::to_string(stray.size()), first = "'" + stray.front().string() + "'";
  return folder.string() + ": " +
         (stray.size() == 1 ? first + " is the mask of no image" : count + " files are masks of no image, " + first + " the first") +
         "; that of image '" + views[example].name + "' would be '" + views[example].name + ".png'";
}

}  // namespace

std::string DescribeMissingMasks(const Workspace& workspace, const std::vector<int>& images) {
  if (images.empty() || workspace.ImageMaskPath(images.front()).empty()) return "";
  std::vector<int> without;
  std::copy_if(images.begin(), images.end(), std::back_inserter(without), [&](int image) { return !workspace.HasImageMask(image); });
  if (without.empty()) return "";
  return std::to_string(without.size()) + " of " + std::to_string(images.size()) +
         " images have no mask and are used whole; the first would be " + workspace.ImageMaskPath(without.front()).string();
}

void CheckMasks(const Workspace& workspace, ProblemList* errors, ProblemList* warnings) {
  const int count = static_cast<int>(workspace.views().size());
  if (count == 0 || workspace.mask_path().empty()) return;
  std::vector<std::string> problems(count);
  tbb::parallel_for(0, count, [&](int image) { problems[image] = MaskProblem(workspace, image); });
  std::copy_if(problems.begin(), problems.end(), std::back_inserter(*errors),
               [](const std::string& problem) { return !problem.empty(); });
  std::vector<int> images(count);
  std::iota(images.begin(), images.end(), 0);
  for (const std::string& warning : {DescribeMissingMasks(workspace, images), DescribeStrayMasks(workspace, workspace.mask_path())}) {
    if (!warning.empty()) warnings->push_back(warning);
  }
}

}  // namespace colmap_ext

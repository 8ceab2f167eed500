#include "colmap_ext/mask_check.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>
#include <numeric>
#include <set>
#include <string_view>
#include <system_error>

#include "colmap_ext/folder_files.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/fusion/fusion_map_reader.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/map_shape.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// Without a camera there is no size that the mask should have.
bool HasSize(const Workspace& workspace, int image) { return workspace.views()[image].camera.pinhole.width > 0; }

template <typename Pixels>
std::string EmptyMaskWarning(const fs::path& path, const Pixels& mask) {
  const bool is_empty = std::all_of(mask.data(), mask.data() + mask.size(), [](std::uint8_t value) { return value == 0; });
  return is_empty ? path.string() + ": the mask leaves the whole image out: it is 0 everywhere" : "";
}

// Reads the mask as stereo does.
std::string StereoMaskWarning(const Workspace& workspace, int image) {
  if (!workspace.HasImageMask(image)) return "";
  const fs::path path = workspace.ImageMaskPath(image);
  if (!HasSize(workspace, image)) return EmptyMaskWarning(path, ReadImageMaskFile(path));
  return EmptyMaskWarning(path, *workspace.ReadImageMask(image));
}

// As fusion does, which stretches masks of other sizes over the image.
std::string FusionMaskWarning(const Workspace& workspace, const fs::path& folder, int image) {
  const fs::path path = workspace.MaskPathIn(folder, image);
  if (!fs::exists(path)) return "";
  const phi::GrayImage mask = ReadImageMaskFile(path);
  const phi::Pinhole& size = workspace.views()[image].camera.pinhole;
  if (!HasSize(workspace, image) || HasShapeOf(size.width, size.height, mask.width(), mask.height())) return EmptyMaskWarning(path, mask);
  return path.string() + ": the mask is " + SizeText(mask.width(), mask.height()) + " pixels, which is not the shape of its " +
         SizeText(size.width, size.height) + " image; make masks of the undistorted images";
}

// By the header of a PNG: gray or colours, and alpha.
bool IsPngWithAlpha(const fs::path& path) {
  constexpr std::size_t kColorType = 25;
  std::array<char, kColorType + 1> bytes{};
  std::ifstream file = OpenRegularFile(path);
  if (!file.read(bytes.data(), bytes.size()) || std::string_view(bytes.data(), 4) != "\x89PNG") return false;
  return bytes[kColorType] == 4 || bytes[kColorType] == 6;
}

std::string DescribeStrayMasks(const Workspace& workspace, const fs::path& folder) {
  std::error_code error;
  const bool is_beside_photos = fs::equivalent(folder, workspace.path() / "images", error);
  std::set<fs::path> known;
  for (const phi::SceneView& view : workspace.views()) {
    known.insert(fs::path(view.name + ".png").lexically_normal());
    if (is_beside_photos) known.insert(fs::path(view.name).lexically_normal());
  }
  std::vector<fs::path> stray = FilesBelow(folder);
  std::erase_if(stray, [&](const fs::path& file) { return known.contains(file); });
  if (stray.empty()) return "";
  // One without a mask: its may be among them.
  const auto& views = workspace.views();
  int example = 0;
  while (example + 1 < static_cast<int>(views.size()) && fs::exists(workspace.MaskPathIn(folder, example))) ++example;
  const std::string count = std::to_string(stray.size()), first = "'" + stray.front().string() + "'";
  return folder.string() + ": " +
         (stray.size() == 1 ? first + " is the mask of no image" : count + " files are masks of no image, " + first + " the first") +
         "; that of image '" + views[example].name + "' would be '" + views[example].name + ".png'";
}

// read_mask(image): what makes results worse, or an empty string. Throws phi::InputError where the mask fails its image.
void CheckFolder(const Workspace& workspace, const fs::path& folder, const std::function<std::string(int)>& read_mask,
                 ProblemList* errors, ProblemList* warnings) {
  const int count = static_cast<int>(workspace.views().size());
  ProblemList errors_of_image(count), warnings_of_image(count);
  tbb::parallel_for(0, count, [&](int image) {
    try {
      warnings_of_image[image] = read_mask(image);
    } catch (const phi::InputError& error) {
      errors_of_image[image] = error.what();
    }
  });
  std::vector<int> images(count);
  std::iota(images.begin(), images.end(), 0);
  warnings_of_image.push_back(DescribeMissingMasks(workspace, folder, images));
  warnings_of_image.push_back(DescribeTransparentMasks(workspace, folder, images));
  warnings_of_image.push_back(DescribeStrayMasks(workspace, folder));
  const auto is_told = [](const std::string& problem) { return !problem.empty(); };
  std::copy_if(errors_of_image.begin(), errors_of_image.end(), std::back_inserter(*errors), is_told);
  std::copy_if(warnings_of_image.begin(), warnings_of_image.end(), std::back_inserter(*warnings), is_told);
}

}  // namespace

std::string DescribeMissingMasks(const Workspace& workspace, const fs::path& folder, const std::vector<int>& images) {
  if (folder.empty()) return "";
  std::vector<int> without;
  std::copy_if(images.begin(), images.end(), std::back_inserter(without),
               [&](int image) { return !fs::exists(workspace.MaskPathIn(folder, image)); });
  if (without.empty()) return "";
  return std::to_string(without.size()) + " of " + std::to_string(images.size()) +
         " images have no mask and are used whole; the first would be " + workspace.MaskPathIn(folder, without.front()).string();
}

std::string DescribeTransparentMasks(const Workspace& workspace, const fs::path& folder, const std::vector<int>& images) {
  if (folder.empty()) return "";
  std::vector<int> with_alpha;
  std::copy_if(images.begin(), images.end(), std::back_inserter(with_alpha),
               [&](int image) { return IsPngWithAlpha(workspace.MaskPathIn(folder, image)); });
  if (with_alpha.empty()) return "";
  return std::to_string(with_alpha.size()) + " masks have a channel of transparency, " +
         workspace.MaskPathIn(folder, with_alpha.front()).string() +
         " the first, which does not count: black in their colours leaves a pixel out; where the mask is in the transparency, save "
         "that as a grey image";
}

void CheckMasks(const Workspace& workspace, ProblemList* errors, ProblemList* warnings) {
  if (workspace.views().empty() || workspace.mask_path().empty()) return;
  CheckFolder(
      workspace, workspace.mask_path(), [&](int image) { return StereoMaskWarning(workspace, image); }, errors, warnings);
}

void CheckFusionMasks(const Workspace& workspace, const fs::path& folder, ProblemList* errors, ProblemList* warnings) {
  if (workspace.views().empty() || folder.empty()) return;
  if (!fs::is_directory(folder)) {
    errors->push_back(NoFolderOfFusionMasks(folder));
    return;
  }
  CheckFolder(
      workspace, folder, [&](int image) { return FusionMaskWarning(workspace, folder, image); }, errors, warnings);
}

}  // namespace colmap_ext

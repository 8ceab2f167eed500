#include "colmap_ext/evaluation/truth_maps.h"

#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "colmap_ext/image_file.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/workspace.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

std::string WithoutSuffix(const std::string& text, const std::string& suffix) {
  return text.ends_with(suffix) ? text.substr(0, text.size() - suffix.size()) : text;
}

}  // namespace

std::map<std::string, std::filesystem::path> FindTruthMaps(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) throw phi::InputError("there is no folder " + folder.string());
  std::map<std::string, std::filesystem::path> maps;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (!entry.is_regular_file() || (extension != ".png" && extension != ".bin")) continue;
    std::string name = entry.path().lexically_relative(folder).replace_extension().generic_string();
    for (std::string_view kind : {kGeometric, kMeasured, kPhotometric}) {
      if (extension == ".bin") name = WithoutSuffix(name, "." + std::string(kind));
    }
    maps[name] = entry.path();
  }
  if (maps.empty())
    throw phi::InputError(folder.string() + " holds no map (<image name>.png or <image name>.bin)");
  return maps;
}

phi::Array2D<float> ReadTruthDepth(const std::filesystem::path& path, double values_per_unit) {
  if (path.extension() == ".bin") return ReadPublishedDepths(path);
  std::ifstream file = OpenRegularFile(path);
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  cv::Mat image;
  if (HasPhotoFormat(bytes)) image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  if (image.empty()) throw phi::InputError("cannot read " + path.string());
  if (image.type() != CV_16UC1) {
    throw phi::InputError(path.string() + " is not a 16-bit gray image, as true depths in PNG files are");
  }
  phi::Array2D<float> depth(image.cols, image.rows);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      depth(x, y) = static_cast<float>(image.at<std::uint16_t>(y, x) / values_per_unit);
    }
  }
  return depth;
}

}  // namespace colmap_ext

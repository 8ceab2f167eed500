#include "colmap_ext/dim_photos.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <optional>

#include "colmap_ext/image_file.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

constexpr int kBright = 1 << 14;

}  // namespace

std::string DescribeDimPhotos(const Workspace& workspace, const std::vector<int>& images) {
  std::vector<int> brightest(images.size(), kBright);
  tbb::parallel_for(std::size_t{0}, images.size(), [&](std::size_t i) {
    const SparseCamera& camera = workspace.model().cameras.at(workspace.model().images[images[i]].camera_id);
    const auto check_size = [&](std::size_t width, std::size_t height) {
      if (width != camera.width || height != camera.height)
        throw phi::InputError("is no photo of the camera");
    };
    try {
      brightest[i] = Brightest16Bit(*workspace.ReadPhoto(images[i]), check_size).value_or(kBright);
    } catch (const phi::InputError&) {
      // told where the photo is used
    }
  });
  const auto is_dim = [](int value) { return value < kBright; };
  const auto first = std::find_if(brightest.begin(), brightest.end(), is_dim);
  if (first == brightest.end()) return "";
  const auto count = std::count_if(first, brightest.end(), is_dim);
  return std::to_string(count) + " of " + std::to_string(images.size()) + " photos looked at, " +
         workspace.views()[images[static_cast<std::size_t>(first - brightest.begin())]].name +
         " the first, have 16 bits but no value above " + std::to_string(*first) +
         " of 65535: scale values of 10, 12 or 14 bits to the full range, else few levels of gray are left "
         "to match";
}

std::string DescribeDimPhotosOfSome(const Workspace& workspace) {
  const int count = static_cast<int>(workspace.views().size());
  if (count == 0) return "";
  std::vector<int> some = {0, count / 2, count - 1};
  some.erase(std::unique(some.begin(), some.end()), some.end());
  return DescribeDimPhotos(workspace, some);
}

}  // namespace colmap_ext

#include "colmap_ext/dim_photos.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "colmap_ext/image_file.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

constexpr int kBright = 1 << 14;

}  // namespace

DimPhotos::DimPhotos(const Workspace& workspace, std::vector<int> images)
    : workspace_(workspace), images_(std::move(images)), brightest_(images_.size(), kBright) {}

void DimPhotos::Look(int i, const PhotoFile& photo) {
  const SparseCamera& camera = workspace_.model().cameras.at(workspace_.model().images[images_[i]].camera_id);
  const auto check_size = [&](std::size_t width, std::size_t height) {
    if (width != camera.width || height != camera.height) throw phi::InputError("is no photo of the camera");
  };
  try {
    brightest_[i] = Brightest16Bit(photo, check_size).value_or(kBright);
  } catch (const phi::InputError&) {
    // told where the photo is used
  }
}

std::string DimPhotos::Describe() const {
  const auto is_dim = [](int value) { return value < kBright; };
  const auto first = std::find_if(brightest_.begin(), brightest_.end(), is_dim);
  if (first == brightest_.end()) return "";
  const auto count = std::count_if(first, brightest_.end(), is_dim);
  return std::to_string(count) + " of " + std::to_string(images_.size()) + " photos looked at, " +
         workspace_.views()[images_[static_cast<std::size_t>(first - brightest_.begin())]].name +
         " the first, have 16 bits but no value above " + std::to_string(*first) +
         " of 65535: scale values of 10, 12 or 14 bits to the full range, else few levels of gray are left "
         "to match";
}

std::string DescribeDimPhotosOfSome(const Workspace& workspace) {
  const int count = static_cast<int>(workspace.views().size());
  if (count == 0) return "";
  std::vector<int> some = {0, count / 2, count - 1};
  some.erase(std::unique(some.begin(), some.end()), some.end());
  DimPhotos photos(workspace, some);
  tbb::parallel_for(0, photos.size(), [&](int i) {
    try {
      photos.Look(i, *workspace.ReadPhoto(some[i]));
    } catch (const phi::InputError&) {
      // told where the photo is used
    }
  });
  return photos.Describe();
}

}  // namespace colmap_ext

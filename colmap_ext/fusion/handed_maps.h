// What the stereo hands to fusion in memory: maps and photos that fusion would else read from their files, the same values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/image_file.h"
#include "phi/measurement.h"

namespace colmap_ext {

// Of one image; null: in its files alone.
struct HandedImage {
  std::shared_ptr<const phi::MeasurementMap> map = nullptr;
  std::shared_ptr<const PhotoFile> photo = nullptr;

  std::int64_t bytes() const;
};

// Of a workspace's images, by their index. Calls for different images may be concurrent.
class HandedMaps {
 public:
  HandedMaps() = default;
  // kind: the maps'.
  HandedMaps(std::string kind, std::size_t num_images) : kind_(std::move(kind)), images_(num_images) {}

  const std::string& kind() const { return kind_; }
  int num_maps() const;
  std::int64_t bytes() const;  // in memory
  void Set(int image, HandedImage handed) { images_[static_cast<std::size_t>(image)] = std::move(handed); }
  const HandedImage& operator[](int image) const { return images_[static_cast<std::size_t>(image)]; }
  // Gives up an image's: fusion has made its own form of it.
  void Forget(int image) { Set(image, {}); }
  // Gives up the last images' until the others take no more than this.
  void Trim(std::int64_t budget_bytes);

 private:
  std::string kind_;
  std::vector<HandedImage> images_;
};

}  // namespace colmap_ext

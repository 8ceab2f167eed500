// Keeps a flag (emitted, or merged) of the pixels of images whose maps were dropped and will be read again, a bit a pixel,
// in an unnamed scratch file: it is the only state of fusion, and memory must not grow with the number of images.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "phi/fusion/fusion_pixel.h"

namespace colmap_ext {

class FlagStore {
 public:
  // flag: a bit of FusionPixel::flags. The scratch file is made in `folder` at the first Save.
  FlagStore(std::filesystem::path folder, std::size_t num_images, std::uint8_t flag);
  ~FlagStore();
  FlagStore(const FlagStore&) = delete;
  FlagStore& operator=(const FlagStore&) = delete;

  // Throws phi::ResourceError when the disk is full.
  void Save(int image, const phi::FusionMap& map);
  // The same of flags as Load returns them: pixel i's is bit i % 8 of byte i / 8.
  void Save(int image, const std::vector<std::uint8_t>& bits);
  // Of an image whose flags were saved.
  std::vector<std::uint8_t> Load(int image, std::size_t num_pixels) const;
  // Sets the flags that were saved; none when there were none. Safe to call concurrently for different images.
  void Restore(int image, phi::FusionMap* map) const;

 private:
  void OpenScratchFile();
  [[noreturn]] void Fail(const char* action) const;

  std::filesystem::path folder_;
  std::uint8_t flag_;
  int descriptor_ = -1;
  std::int64_t end_ = 0;
  std::vector<std::int64_t> offsets_;  // -1: not saved
};

}  // namespace colmap_ext

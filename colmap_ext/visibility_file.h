// The images that see each point of a fused cloud: COLMAP's .vis file beside the .ply.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

namespace colmap_ext {

// Reads one point after the other, in bounded memory. The file: uint64 number of points; of each point a uint32 number of images
// and so many uint32 indices of images in the sparse model's order.
class VisibilityReader {
 public:
  // A file that is not there or has no count holds no points.
  explicit VisibilityReader(const std::filesystem::path& path);

  std::uint64_t num_points() const { return num_points_; }

  // False where the file is cut short; `images` then holds those before its end.
  bool Next(std::vector<std::uint32_t>* images);
  bool Skip(std::uint64_t num_points);

 private:
  bool NextWord(std::uint32_t* word);
  bool SkipWords(std::size_t num_words);
  bool Refill();

  std::ifstream file_;
  std::uint64_t num_points_ = 0;
  std::vector<std::uint32_t> words_;
  std::size_t position_ = 0, end_ = 0;
};

}  // namespace colmap_ext

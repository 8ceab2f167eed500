#include "colmap_ext/visibility_file.h"

#include "colmap_ext/input_file.h"
#include "phi/base/cancellation.h"

namespace colmap_ext {

VisibilityReader::VisibilityReader(const std::filesystem::path& path)
    : file_(OpenRegularFile(path)), words_(std::size_t{1} << 18) {
  std::uint64_t count = 0;
  if (file_.read(reinterpret_cast<char*>(&count), sizeof(count))) num_points_ = count;
}

bool VisibilityReader::Refill() {
  phi::ThrowIfCancelled();
  file_.read(reinterpret_cast<char*>(words_.data()),
             static_cast<std::streamsize>(words_.size() * sizeof(words_[0])));
  end_ = static_cast<std::size_t>(file_.gcount()) / sizeof(words_[0]);
  position_ = 0;
  return end_ > 0;
}

bool VisibilityReader::NextWord(std::uint32_t* word) {
  if (position_ == end_ && !Refill()) return false;
  *word = words_[position_++];
  return true;
}

bool VisibilityReader::SkipWords(std::size_t num_words) {
  while (num_words > end_ - position_) {
    num_words -= end_ - position_;
    if (!Refill()) return false;
  }
  position_ += num_words;
  return true;
}

bool VisibilityReader::Next(std::vector<std::uint32_t>* images) {
  images->clear();
  std::uint32_t num_images = 0, image = 0;
  if (!NextWord(&num_images)) return false;
  for (std::uint32_t i = 0; i < num_images; ++i) {
    if (!NextWord(&image)) return false;
    images->push_back(image);
  }
  return true;
}

bool VisibilityReader::Skip(std::uint64_t num_points) {
  std::uint32_t num_images = 0;
  for (std::uint64_t i = 0; i < num_points; ++i) {
    if (!NextWord(&num_images) || !SkipWords(num_images)) return false;
  }
  return true;
}

}  // namespace colmap_ext

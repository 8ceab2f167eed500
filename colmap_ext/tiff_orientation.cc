#include "colmap_ext/tiff_orientation.h"

#include <cstddef>

namespace colmap_ext {
namespace {

// Numbers of 2 and 4 bytes in the file's byte order. Positions beyond its end hold 0.
class TiffNumbers {
 public:
  TiffNumbers(std::span<std::uint8_t> file, bool big_endian) : file_(file), big_endian_(big_endian) {}

  std::size_t Get(std::size_t at, int num_bytes) const {
    if (at + num_bytes > file_.size()) return 0;
    std::size_t value = 0;
    for (int i = 0; i < num_bytes; ++i) value |= std::size_t{file_[at + i]} << Shift(i, num_bytes);
    return value;
  }

  void Set(std::size_t at, int num_bytes, std::size_t value) const {
    if (at + num_bytes > file_.size()) return;
    for (int i = 0; i < num_bytes; ++i) {
      file_[at + i] = static_cast<std::uint8_t>(value >> Shift(i, num_bytes));
    }
  }

 private:
  int Shift(int i, int num_bytes) const { return 8 * (big_endian_ ? num_bytes - 1 - i : i); }

  std::span<std::uint8_t> file_;
  bool big_endian_;
};

}  // namespace

void IgnoreTiffOrientation(std::span<std::uint8_t> file) {
  constexpr std::size_t kVersion = 42, kOrientation = 274, kAsStored = 1, kEntryBytes = 12;
  if (file.size() < 8 || file[0] != file[1] || (file[0] != 'I' && file[0] != 'M')) return;
  const TiffNumbers numbers(file, file[0] == 'M');
  if (numbers.Get(2, 2) != kVersion) return;
  const std::size_t directory = numbers.Get(4, 4), num_entries = numbers.Get(directory, 2);
  for (std::size_t i = 0; i < num_entries; ++i) {
    const std::size_t entry = directory + 2 + i * kEntryBytes;  // tag, type, count, value
    if (numbers.Get(entry, 2) == kOrientation) numbers.Set(entry + 8, 2, kAsStored);
  }
}

}  // namespace colmap_ext

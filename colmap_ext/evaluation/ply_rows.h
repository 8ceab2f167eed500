// Streams the rows of a PLY file (ASCII, little- or big-endian) without holding them: clouds of 10^8 points,
// scans and meshes with whatever properties their makers gave them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace colmap_ext {

struct PlyProperty {
  std::string name;
  int type = 0;         // index into the format's scalar types
  int count_type = -1;  // of a list's length; -1 = not a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  bool Has(const std::string& property) const;
};

class PlyRows {
 public:
  // Reads the header. Throws phi::InputError naming the file when it is no PLY file.
  explicit PlyRows(const std::filesystem::path& path);

  // To add to x, y and z for the world's coordinates: of a header line `comment offset X Y Z`, as stereo_fusion writes it; rows are
  // given as the file has them.
  const std::array<double, 3>& offset() const { return offset_; }

  // Null when the file has no such element.
  const PlyElement* Find(const std::string& element) const;

  // Calls `row` with the named scalar properties of each row, in the order of `properties`; NaN for those
  // that the element lacks. Throws phi::InputError when the file ends early.
  void ForEachRow(const std::string& element, const std::vector<std::string>& properties,
                  const std::function<void(const double*)>& row) const;

  // The same for the rows at these positions: ascending, below the element's count. In a binary file without lists the
  // others cost next to nothing.
  void ForChosenRows(const std::string& element, const std::vector<std::string>& properties,
                     const std::vector<std::uint64_t>& positions, const std::function<void(const double*)>& row) const;

  // The same for one list property.
  void ForEachList(const std::string& element, const std::string& property,
                   const std::function<void(const std::vector<std::int64_t>&)>& row) const;

 private:
  enum class Encoding { kAscii, kLittleEndian, kBigEndian };
  class Source;
  class RowBlocks;
  struct RowLayout;

  [[noreturn]] void EndsEarly() const;
  [[noreturn]] void HoldsNoNumber(const std::string& word) const;
  // None where its rows differ in size, or those before them do.
  std::optional<RowLayout> LayoutOf(const std::string& element) const;

  // Visits every value of `element`: value(property index, is list entry, value), then end of row.
  template <typename OnValue, typename OnRow>
  void Visit(const std::string& element, OnValue on_value, OnRow on_row) const;

  std::filesystem::path path_;
  Encoding encoding_ = Encoding::kAscii;
  std::array<double, 3> offset_{0, 0, 0};
  std::vector<PlyElement> elements_;
  std::uint64_t data_offset_ = 0;
};

}  // namespace colmap_ext

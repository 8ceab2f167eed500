#include "colmap_ext/evaluation/ply_rows.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <string_view>
#include <system_error>

#include "colmap_ext/input_file.h"
#include "colmap_ext/text_stream.h"
#include "phi/base/c_locale.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

static_assert(std::endian::native == std::endian::little);

struct ScalarType {
  std::string_view name, other_name;
  int bytes;
};

constexpr std::array<ScalarType, 8> kTypes = {{{"char", "int8", 1},
                                               {"uchar", "uint8", 1},
                                               {"short", "int16", 2},
                                               {"ushort", "uint16", 2},
                                               {"int", "int32", 4},
                                               {"uint", "uint32", 4},
                                               {"float", "float32", 4},
                                               {"double", "float64", 8}}};

constexpr std::size_t kBlockBytes = std::size_t{1} << 20;

int TypeIndex(const std::string& name) {
  for (std::size_t i = 0; i < kTypes.size(); ++i) {
    if (name == kTypes[i].name || name == kTypes[i].other_name) return static_cast<int>(i);
  }
  return -1;
}

template <typename T>
double As(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

double Decode(int type, const char* bytes) {
  switch (type) {
    case 0:
      return As<std::int8_t>(bytes);
    case 1:
      return As<std::uint8_t>(bytes);
    case 2:
      return As<std::int16_t>(bytes);
    case 3:
      return As<std::uint16_t>(bytes);
    case 4:
      return As<std::int32_t>(bytes);
    case 5:
      return As<std::uint32_t>(bytes);
    case 6:
      return As<float>(bytes);
    default:
      return As<double>(bytes);
  }
}

double DecodeBigEndian(int type, const char* bytes) {
  std::array<char, 8> reversed;
  std::reverse_copy(bytes, bytes + kTypes[type].bytes, reversed.begin());
  return Decode(type, reversed.data());
}

// By property of the element: its place in `properties`, or -1.
std::vector<int> Slots(const PlyElement& element, const std::vector<std::string>& properties) {
  std::vector<int> slots;
  for (const PlyProperty& p : element.properties) {
    const auto it = std::find(properties.begin(), properties.end(), p.name);
    slots.push_back(it == properties.end() || p.count_type >= 0 ? -1 : static_cast<int>(it - properties.begin()));
  }
  return slots;
}

// Of a row without lists.
std::size_t RowBytes(const PlyElement& element) {
  std::size_t bytes = 0;
  for (const PlyProperty& p : element.properties) bytes += static_cast<std::size_t>(kTypes[p.type].bytes);
  return bytes;
}

bool HasLists(const PlyElement& element) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [](const PlyProperty& p) { return p.count_type >= 0; });
}

// -1 for what is no whole number of a size that a file could hold.
std::int64_t ToIndex(double value) {
  constexpr double kLargest = 1ull << 53;
  return value >= 0 && value <= kLargest ? static_cast<std::int64_t>(value) : -1;
}

// "property float x" or "property list uchar int vertex_indices"; false when it is neither.
bool ParseProperty(TextInput& line, PlyProperty& property) {
  std::string type;
  line >> type;
  if (type == "list") {
    std::string count_type;
    line >> count_type >> type;
    property.count_type = TypeIndex(count_type);
    if (property.count_type < 0) return false;
  }
  property.type = TypeIndex(type);
  return property.type >= 0 && static_cast<bool>(line >> property.name);
}

// "offset X Y Z"; none of any other comment.
std::optional<std::array<double, 3>> ParseOffset(TextInput& comment) {
  std::string word;
  std::array<double, 3> offset;
  if (!(comment >> word) || word != "offset" || !(comment >> offset[0] >> offset[1] >> offset[2])) return {};
  if (comment >> word) return {};
  return offset;
}

}  // namespace

bool PlyElement::Has(const std::string& property) const {
  return std::any_of(properties.begin(), properties.end(), [&](const auto& p) { return p.name == property; });
}

void PlyRows::EndsEarly() const {
  throw phi::InputError(phi::AboutFile(path_) + " ends before its header says it should; copy or write it again");
}

void PlyRows::HoldsNoNumber(const std::string& word) const {
  constexpr std::size_t kShown = 40;
  throw phi::InputError(phi::AboutFile(path_) + " holds '" + word.substr(0, kShown) +
                        "' where a number is expected; copy or write it again");
}

// Where an element's rows lie in a binary file.
struct PlyRows::RowLayout {
  std::uint64_t first_byte;
  std::size_t row_bytes;
};

// The data part of the file, value by value.
class PlyRows::Source {
 public:
  explicit Source(const PlyRows& rows) : rows_(rows), stream_(OpenRegularFile(rows.path_)) {
    stream_.seekg(static_cast<std::streamoff>(rows.data_offset_));
  }

  double Next(int type) {
    if (rows_.encoding_ == Encoding::kAscii) {
      std::string word;
      if (!(stream_ >> word)) rows_.EndsEarly();
      if (++num_words_ % kWordsBetweenChecks == 0) phi::ThrowIfCancelled();
      char* end = nullptr;
      const double value = phi::ParseDouble(word, &end);  // unlike streams, knows nan and inf
      if (end != word.c_str() + word.size()) rows_.HoldsNoNumber(word);
      return value;
    }
    std::array<char, 8> bytes;
    Take(bytes.data(), kTypes[type].bytes);
    return rows_.encoding_ == Encoding::kBigEndian ? DecodeBigEndian(type, bytes.data()) : Decode(type, bytes.data());
  }

 private:
  void Take(char* to, std::size_t size) {
    while (size > 0) {
      if (position_ == end_) {
        stream_.read(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
        end_ = static_cast<std::size_t>(stream_.gcount());
        position_ = 0;
        if (end_ == 0) rows_.EndsEarly();
        phi::ThrowIfCancelled();
      }
      const std::size_t part = std::min(size, end_ - position_);
      std::memcpy(to, buffer_.data() + position_, part);
      position_ += part;
      to += part;
      size -= part;
    }
  }

  static constexpr std::uint64_t kWordsBetweenChecks = 1 << 16;
  const PlyRows& rows_;
  std::ifstream stream_;
  std::uint64_t num_words_ = 0;
  std::vector<char> buffer_ = std::vector<char>(std::size_t{1} << 16);  // bytes
  std::size_t position_ = 0, end_ = 0;
};

// Rows of an element whose layout is known, read in blocks.
class PlyRows::RowBlocks {
 public:
  RowBlocks(const PlyRows& rows, const PlyElement& element, const std::vector<std::string>& properties)
      : rows_(rows),
        layout_(*rows.LayoutOf(element.name)),
        num_rows_(element.count),
        rows_per_block_(std::max<std::uint64_t>(1, kBlockBytes / layout_.row_bytes)),
        stream_(OpenRegularFile(rows.path_)),
        values_(properties.size(), std::numeric_limits<double>::quiet_NaN()) {
    const std::vector<int> slots = Slots(element, properties);
    std::size_t first_byte = 0;
    for (std::size_t p = 0; p < slots.size(); ++p) {
      const int type = element.properties[p].type;
      if (slots[p] >= 0) wanted_.push_back({type, first_byte, static_cast<std::size_t>(slots[p])});
      first_byte += static_cast<std::size_t>(kTypes[type].bytes);
    }
  }

  // Until the next call. Positions ascend.
  const double* Row(std::uint64_t position) {
    if (position >= end_) ReadBlock(position);
    const char* row = block_.data() + (position - begin_) * layout_.row_bytes;
    const bool is_reversed = rows_.encoding_ == Encoding::kBigEndian;
    for (const Wanted& w : wanted_) {
      values_[w.slot] = is_reversed ? DecodeBigEndian(w.type, row + w.first_byte) : Decode(w.type, row + w.first_byte);
    }
    return values_.data();
  }

 private:
  struct Wanted {
    int type;
    std::size_t first_byte;  // in the row
    std::size_t slot;
  };

  void ReadBlock(std::uint64_t position) {
    phi::ThrowIfCancelled();
    begin_ = position / rows_per_block_ * rows_per_block_;
    end_ = std::min(begin_ + rows_per_block_, num_rows_);
    block_.resize((end_ - begin_) * layout_.row_bytes);
    stream_.seekg(static_cast<std::streamoff>(layout_.first_byte + begin_ * layout_.row_bytes));
    if (!stream_.read(block_.data(), static_cast<std::streamsize>(block_.size()))) rows_.EndsEarly();
  }

  const PlyRows& rows_;
  RowLayout layout_;
  std::uint64_t num_rows_, rows_per_block_;
  std::ifstream stream_;
  std::vector<double> values_;
  std::vector<Wanted> wanted_;
  std::vector<char> block_;
  std::uint64_t begin_ = 0, end_ = 0;  // rows in `block_`
};

PlyRows::PlyRows(const std::filesystem::path& path) : path_(path) {
  std::ifstream stream = OpenNeededFile(path);
  const auto refuse = [&](const std::string& why) {
    throw phi::InputError(phi::AboutFile(path) + " is not a PLY file that can be read: " + why + "; copy or write it again");
  };
  std::string text;
  bool has_format = false, has_end = false;
  for (int number = 0; !has_end && std::getline(stream, text); ++number) {
    if (!text.empty() && text.back() == '\r') text.pop_back();
    TextInput line(text);
    std::string word;
    line >> word;
    if (number == 0 && word != "ply") refuse("it does not begin with 'ply'");
    if (word == "format") {
      line >> word;
      has_format = true;
      if (word == "binary_little_endian") {
        encoding_ = Encoding::kLittleEndian;
      } else if (word == "binary_big_endian") {
        encoding_ = Encoding::kBigEndian;
      } else if (word != "ascii") {
        refuse("unknown format '" + word + "'");
      }
    } else if (word == "comment") {
      if (const auto offset = ParseOffset(line)) offset_ = *offset;
    } else if (word == "element") {
      PlyElement element;
      if (!(line >> element.name >> element.count)) refuse("bad line '" + text + "'");
      elements_.push_back(element);
    } else if (word == "property") {
      PlyProperty property;
      if (elements_.empty() || !ParseProperty(line, property)) refuse("bad line '" + text + "'");
      elements_.back().properties.push_back(property);
    }
    has_end = word == "end_header";
  }
  if (!has_format || !has_end) refuse("its header is incomplete");
  data_offset_ = static_cast<std::uint64_t>(stream.tellg());
}

const PlyElement* PlyRows::Find(const std::string& element) const {
  for (const PlyElement& e : elements_) {
    if (e.name == element) return &e;
  }
  return nullptr;
}

template <typename OnValue, typename OnRow>
void PlyRows::Visit(const std::string& element, OnValue on_value, OnRow on_row) const {
  Source source(*this);
  for (const PlyElement& e : elements_) {
    const bool wanted = e.name == element;
    if (e.properties.empty()) {  // rows without a byte, however many the header promises
      if (wanted) return;
      continue;
    }
    for (std::uint64_t row = 0; row < e.count; ++row) {
      for (std::size_t p = 0; p < e.properties.size(); ++p) {
        const PlyProperty& property = e.properties[p];
        const bool is_list = property.count_type >= 0;
        const double count = is_list ? source.Next(property.count_type) : 1;
        for (double i = 0; i < count; ++i) {
          const double value = source.Next(property.type);
          if (wanted) on_value(p, value);
        }
      }
      if (wanted) on_row();
    }
    if (wanted) return;
  }
}

void PlyRows::ForEachRow(const std::string& element, const std::vector<std::string>& properties,
                         const std::function<void(const double*)>& row) const {
  const PlyElement* found = Find(element);
  if (!found) return;
  if (LayoutOf(element)) {
    RowBlocks blocks(*this, *found, properties);
    for (std::uint64_t position = 0; position < found->count; ++position) row(blocks.Row(position));
    return;
  }
  std::vector<double> values(properties.size(), std::numeric_limits<double>::quiet_NaN());
  const std::vector<int> slot = Slots(*found, properties);
  Visit(
      element,
      [&](std::size_t p, double value) {
        if (slot[p] >= 0) values[slot[p]] = value;
      },
      [&] { row(values.data()); });
}

std::optional<PlyRows::RowLayout> PlyRows::LayoutOf(const std::string& element) const {
  if (encoding_ == Encoding::kAscii) return {};
  std::uint64_t first_byte = data_offset_;
  std::error_code vanished;  // reading says so then
  const std::uint64_t file_bytes = std::filesystem::file_size(path_, vanished);
  for (const PlyElement& e : elements_) {
    const std::size_t row_bytes = RowBytes(e);
    if (HasLists(e) || row_bytes == 0) return {};
    if (e.count > (file_bytes - first_byte) / row_bytes) EndsEarly();
    if (e.name == element) return RowLayout{first_byte, row_bytes};
    first_byte += e.count * row_bytes;
  }
  return {};
}

void PlyRows::ForChosenRows(const std::string& element, const std::vector<std::string>& properties,
                            const std::vector<std::uint64_t>& positions,
                            const std::function<void(const double*)>& row) const {
  if (!LayoutOf(element)) {
    std::uint64_t position = 0;
    auto next = positions.begin();
    ForEachRow(element, properties, [&](const double* values) {
      if (next == positions.end() || *next != position++) return;
      row(values);
      ++next;
    });
    return;
  }
  RowBlocks blocks(*this, *Find(element), properties);
  for (const std::uint64_t position : positions) row(blocks.Row(position));
}

void PlyRows::ForEachList(const std::string& element, const std::string& property,
                          const std::function<void(const std::vector<std::int64_t>&)>& row) const {
  const PlyElement* found = Find(element);
  if (!found) return;
  std::vector<std::int64_t> values;
  Visit(
      element,
      [&](std::size_t p, double value) {
        if (found->properties[p].name == property) values.push_back(ToIndex(value));
      },
      [&] {
        row(values);
        values.clear();
      });
}

}  // namespace colmap_ext

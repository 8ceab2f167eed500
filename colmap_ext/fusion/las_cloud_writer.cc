// LAS 1.4, as the ASPRS's specification of 2019 (R15) has it: little endian, point data record format 7.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/fusion/cloud_files.h"
#include "colmap_ext/fusion/cloud_writer.h"

namespace colmap_ext {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kHeaderBytes = 375, kRecordHeaderBytes = 54;
constexpr std::size_t kExtraBytesDescriptor = 192;
constexpr std::uint8_t kPointFormat = 7;
constexpr std::size_t kFormatBytes = 36, kExtraBytes = 4, kPointBytes = kFormatBytes + kExtraBytes;
constexpr std::uint16_t kWktBit = 1 << 4;
constexpr std::uint8_t kUnclassified = 1, kOnlyReturn = 1 | 1 << 4;  // the first of one
constexpr int kExtraUint8 = 1, kExtraUint16 = 3;                      // data types of extra bytes

// Bytes by their place.
class Record {
 public:
  explicit Record(std::size_t num_bytes) : bytes_(num_bytes, '\0') {}
  template <typename Value>
  Record& Put(std::size_t offset, Value value) {
    std::memcpy(bytes_.data() + offset, &value, sizeof(value));
    return *this;
  }
  // Cut to at most num_bytes; the rest stays zero.
  Record& PutText(std::size_t offset, std::size_t num_bytes, const std::string& text) {
    std::memcpy(bytes_.data() + offset, text.data(), std::min(num_bytes, text.size()));
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

// A variable length record.
std::string MakeRecord(const std::string& user, std::uint16_t id, const std::string& description,
                       const std::string& content) {
  return Record(kRecordHeaderBytes)
             .PutText(2, 16, user)
             .Put(18, id)
             .Put(20, static_cast<std::uint16_t>(content.size()))
             .PutText(22, 32, description)
             .bytes() +
         content;
}

std::string DescribeExtra(int type, const std::string& name, const std::string& description) {
  return Record(kExtraBytesDescriptor)
      .Put(2, static_cast<std::uint8_t>(type))
      .PutText(4, 32, name)
      .PutText(160, 32, description)
      .bytes();
}

std::vector<std::string> MakeRecords(const std::string& crs) {
  std::vector<std::string> records = {
      MakeRecord("LASF_Spec", 4, "extra bytes",
                 DescribeExtra(kExtraUint16, "views", "images that see the point") +
                     DescribeExtra(kExtraUint8, "inferred", "1: most depths were inferred") +
                     DescribeExtra(kExtraUint8, "confidence", "per cent; 0: not judged"))};
  if (!crs.empty()) records.push_back(MakeRecord("LASF_Projection", 2112, "OGC WKT", crs + '\0'));
  return records;
}

class LasCloudWriter : public CloudWriter {
 public:
  explicit LasCloudWriter(const LasCloudOptions& options)
      : options_(options), records_(MakeRecords(options.crs)), file_(options.path) {
    file_.Write(Header());
    for (const std::string& record : records_) file_.Write(record);
  }

  void Write(phi::FusedBlock block) override {
    for (std::size_t i = 0; i < block.points.size(); ++i) Add(block.points[i], block.view_counts[i], nullptr);
    Flush();
  }

  bool Add(const phi::FusedPoint& point, std::uint32_t num_views, const std::uint32_t*) override {
    const auto units = InUnits(point);
    if (!units) {
      ++num_beyond_;
      return false;
    }
    char row[kPointBytes] = {};
    std::memcpy(row, units->data(), sizeof(*units));
    row[14] = static_cast<char>(kOnlyReturn);
    row[16] = static_cast<char>(kUnclassified);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto color = static_cast<std::uint16_t>(point.rgb[c] * 257);  // the whole range of 16 bits
      std::memcpy(row + 30 + 2 * c, &color, sizeof(color));
    }
    const auto views = static_cast<std::uint16_t>(std::min<std::uint32_t>(num_views, 0xffff));
    std::memcpy(row + kFormatBytes, &views, sizeof(views));
    row[kFormatBytes + 2] = static_cast<char>(point.inferred);
    row[kFormatBytes + 3] = static_cast<char>(point.confidence);
    rows_.insert(rows_.end(), row, row + kPointBytes);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      least_[axis] = std::min(least_[axis], (*units)[axis]);
      most_[axis] = std::max(most_[axis], (*units)[axis]);
    }
    ++num_points_;
    return true;
  }

  void Flush() override {
    file_.Write(rows_.data(), rows_.size());
    rows_.clear();
  }

  std::uint64_t num_left_out() const override { return num_beyond_; }

  void Commit() override {
    file_.WriteAt(0, Header());
    file_.Commit();
  }

 private:
  // Its position in whole multiples of the scale from the offset; none where 32 bits do not reach.
  std::optional<std::array<std::int32_t, 3>> InUnits(const phi::FusedPoint& point) const {
    std::array<std::int32_t, 3> units;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = std::round((point.xyz[axis] - options_.offset[axis]) / options_.scale);
      if (!(std::abs(value) <= std::numeric_limits<std::int32_t>::max())) return std::nullopt;
      units[axis] = static_cast<std::int32_t>(value);
    }
    return units;
  }

  double Coordinate(std::size_t axis, std::int32_t units) const {
    return num_points_ == 0 ? 0 : units * options_.scale + options_.offset[axis];
  }

  std::string Header() const {
    std::size_t data_offset = kHeaderBytes;
    for (const std::string& record : records_) data_offset += record.size();
    Record header(kHeaderBytes);
    header.PutText(0, 4, "LASF")
        .Put(6, kWktBit)
        .Put(24, std::uint8_t{1})
        .Put(25, std::uint8_t{4})
        .PutText(kLasSystemAt, 32, std::string(kLasSystem))
        .PutText(58, 32, std::string("phimvs ") + PHIMVS_VERSION)
        .Put(94, static_cast<std::uint16_t>(kHeaderBytes))
        .Put(96, static_cast<std::uint32_t>(data_offset))
        .Put(100, static_cast<std::uint32_t>(records_.size()))
        .Put(104, kPointFormat)
        .Put(105, static_cast<std::uint16_t>(kPointBytes));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      header.Put(131 + 8 * axis, options_.scale)
          .Put(155 + 8 * axis, options_.offset[axis])
          .Put(179 + 16 * axis, Coordinate(axis, most_[axis]))
          .Put(187 + 16 * axis, Coordinate(axis, least_[axis]));
    }
    return header.Put(247, num_points_).Put(255, num_points_).bytes();  // all of them first returns
  }

  const LasCloudOptions options_;
  const std::vector<std::string> records_;
  AtomicFile file_;
  std::vector<char> rows_;
  std::uint64_t num_points_ = 0, num_beyond_ = 0;
  std::array<std::int32_t, 3> least_{std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::max(),
                                     std::numeric_limits<std::int32_t>::max()};
  std::array<std::int32_t, 3> most_{std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::min(),
                                    std::numeric_limits<std::int32_t>::min()};
};

}  // namespace

std::unique_ptr<CloudWriter> MakeLasCloudWriter(const LasCloudOptions& options) {
  return std::make_unique<LasCloudWriter>(options);
}

}  // namespace colmap_ext

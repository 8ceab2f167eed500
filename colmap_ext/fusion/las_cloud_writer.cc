// LAS 1.4, as the ASPRS's specification of 2019 (R15) has it: little endian, point data record format 7.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
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
      : options_(options),
        records_(MakeRecords(options.crs)),
        file_(std::make_shared<AtomicFile>(options.path, Durability::kPowerCut, options.queues->point_files)) {
    file_->Write(Header());
    for (const std::string& record : records_) file_->Write(record);
  }

  std::function<void()> Prepare(phi::FusedBlock block) override {
    return [this, packed = std::make_shared<const Packed>(Pack(block))] { Queue(packed); };
  }

  bool Add(const phi::FusedPoint& point, std::uint32_t num_views, const std::uint32_t*) override {
    return PackPoint(point, num_views, &added_);
  }
  void Flush() override { Queue(std::make_shared<const Packed>(std::exchange(added_, {}))); }

  std::uint64_t num_left_out() const override { return total_.num_beyond; }

  void Complete() override {
    if (is_complete_) return;
    options_.queues->points.Finish();
    file_->WriteAt(0, Header());
    file_->Complete();
    is_complete_ = true;
  }

  void Commit() override {
    Complete();
    file_->Commit();
  }

 private:
  using Units = std::array<std::int32_t, 3>;

  // What the header says of points, and how many are left out.
  struct Extent {
    std::uint64_t num_points = 0, num_beyond = 0;
    Units least = AllOf(std::numeric_limits<std::int32_t>::max()), most = AllOf(std::numeric_limits<std::int32_t>::min());

    void Include(const Units& low, const Units& high) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        least[axis] = std::min(least[axis], low[axis]);
        most[axis] = std::max(most[axis], high[axis]);
      }
    }
    void Include(const Extent& other) {
      num_points += other.num_points;
      num_beyond += other.num_beyond;
      Include(other.least, other.most);
    }
  };
  // As the file holds them.
  struct Packed {
    std::vector<char> rows;
    Extent extent;
  };
  static Units AllOf(std::int32_t value) { return {value, value, value}; }

  Packed Pack(const phi::FusedBlock& block) const {
    Packed packed;
    packed.rows.reserve(block.points.size() * kPointBytes);
    for (std::size_t i = 0; i < block.points.size(); ++i) PackPoint(block.points[i], block.view_counts[i], &packed);
    return packed;
  }

  // False: 32 bits do not reach it.
  bool PackPoint(const phi::FusedPoint& point, std::uint32_t num_views, Packed* packed) const {
    const auto units = InUnits(point);
    if (!units) {
      ++packed->extent.num_beyond;
      return false;
    }
    packed->rows.resize(packed->rows.size() + kPointBytes);
    char* const row = packed->rows.data() + packed->rows.size() - kPointBytes;
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
    packed->extent.Include(*units, *units);
    ++packed->extent.num_points;
    return true;
  }

  void Queue(const std::shared_ptr<const Packed>& packed) {
    total_.Include(packed->extent);
    options_.queues->points.Add(packed->rows.size(), [file = file_, packed] { file->Write(packed->rows.data(), packed->rows.size()); });
  }

  // Its position in whole multiples of the scale from the offset; none where 32 bits do not reach.
  std::optional<Units> InUnits(const phi::FusedPoint& point) const {
    Units units;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = std::round((point.xyz[axis] - options_.offset[axis]) / options_.scale);
      if (!(std::abs(value) <= std::numeric_limits<std::int32_t>::max())) return std::nullopt;
      units[axis] = static_cast<std::int32_t>(value);
    }
    return units;
  }

  double Coordinate(std::size_t axis, std::int32_t units) const {
    return total_.num_points == 0 ? 0 : units * options_.scale + options_.offset[axis];
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
          .Put(179 + 16 * axis, Coordinate(axis, total_.most[axis]))
          .Put(187 + 16 * axis, Coordinate(axis, total_.least[axis]));
    }
    return header.Put(247, total_.num_points).Put(255, total_.num_points).bytes();  // all of them first returns
  }

  const LasCloudOptions options_;
  const std::vector<std::string> records_;
  const std::shared_ptr<AtomicFile> file_;  // writes hold it, too: queues that others share may outlive this
  Packed added_;  // to be written with the next Flush()
  Extent total_;  // of what the file holds, or will
  bool is_complete_ = false;
};

}  // namespace

std::unique_ptr<CloudWriter> MakeLasCloudWriter(const LasCloudOptions& options) {
  return std::make_unique<LasCloudWriter>(options);
}

}  // namespace colmap_ext

// Header: magic, key, the offset of the summary, the number of bytes. Then blocks of points: their number, that of their views,
// points, view counts, views. Last the summary: the length of a JSON object, the object, the flags of its images.
#include "colmap_ext/fusion/part_files.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <string_view>
#include <type_traits>
#include <utility>

#include "colmap_ext/json_file.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::string_view kMagic = "phimvsF2";
constexpr std::size_t kKeyBytes = 16;
constexpr std::size_t kNumbersOffset = kMagic.size() + kKeyBytes,
                      kHeaderBytes = kNumbersOffset + 2 * sizeof(std::uint64_t);

static_assert(std::is_trivially_copyable_v<phi::FusedPoint> && sizeof(phi::FusedPoint) == 40);  // no gaps

template <typename T>
std::string_view BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string NumberBytes(std::uint64_t value) {
  std::string bytes(sizeof(value), '\0');
  std::memcpy(bytes.data(), &value, sizeof(value));
  return bytes;
}

class PartFileReader {
 public:
  explicit PartFileReader(const fs::path& path) : path_(path), file_(path, std::ios::binary) {
    std::error_code missing;
    num_bytes_ = fs::file_size(path, missing);
    std::string header(kMagic.size() + kKeyBytes, '\0');
    if (missing || num_bytes_ < kHeaderBytes ||
        !file_.read(header.data(), static_cast<std::streamsize>(header.size())) ||
        !header.starts_with(kMagic)) {
      Fail();
    }
    key_ = header.substr(kMagic.size());
    summary_offset_ = Number();
    if (Number() != num_bytes_ || summary_offset_ < kHeaderBytes || summary_offset_ > num_bytes_) Fail();
  }

  const std::string& key() const { return key_; }
  bool IsAtSummary() { return static_cast<std::uint64_t>(file_.tellg()) == summary_offset_; }
  void GoToSummary() { file_.seekg(static_cast<std::streamoff>(summary_offset_)); }

  std::uint64_t Number() {
    std::uint64_t value = 0;
    if (!file_.read(reinterpret_cast<char*>(&value), sizeof(value))) Fail();
    return value;
  }

  template <typename T>
  std::vector<T> Values(std::uint64_t count) {
    if (count > num_bytes_ / sizeof(T)) Fail();
    std::vector<T> values(count);
    if (!file_.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T))))
      Fail();
    return values;
  }

  [[noreturn]] void Fail() const {
    throw phi::InputError(phi::AboutFile(path_) +
                          ": this part of the fusion is damaged; remove it and run the command again");
  }

 private:
  fs::path path_;
  std::ifstream file_;
  std::uint64_t num_bytes_ = 0, summary_offset_ = 0;
  std::string key_;
};

Json ToJson(const PartSummary& summary) {
  Json images = Json::array(), outcomes = Json::array(), failures = Json::array(), noise = Json::array(),
       confidence_maps = Json::array();
  for (const PartImage& image : summary.images) images.push_back({image.position, image.flags.size()});
  for (int i = 0; i < phi::kNumPixelOutcomes; ++i)
    outcomes.push_back(summary.findings.outcomes[static_cast<phi::PixelOutcome>(i)]);
  for (const auto& [position, message] : summary.findings.failures) failures.push_back({position, message});
  for (const auto& [position, value] : summary.findings.noise) noise.push_back({position, value});
  for (const auto& [position, identity] : summary.confidence_maps) confidence_maps.push_back({position, identity.Text()});
  return {{"images", images},
          {"outcomes", outcomes},
          {"failures", failures},
          {"noise", noise},
          {"confidence_maps", confidence_maps},
          {"reads", summary.findings.num_map_reads},
          {"points", summary.findings.num_points}};
}

SceneFuser::Findings FindingsFromJson(const Json& json) {
  SceneFuser::Findings findings;
  findings.num_map_reads = json.at("reads").get<std::int64_t>();
  findings.num_points = json.at("points").get<std::int64_t>();
  for (int i = 0; i < phi::kNumPixelOutcomes; ++i)
    findings.outcomes[static_cast<phi::PixelOutcome>(i)] = json.at("outcomes").at(i).get<std::int64_t>();
  for (const Json& failure : json.at("failures")) findings.failures[failure.at(0)] = failure.at(1);
  for (const Json& noise : json.at("noise")) findings.noise[noise.at(0)] = noise.at(1);
  return findings;
}

// function(json, reader), which stands where the flags begin.
template <typename Function>
auto WithSummary(const fs::path& path, const Function& function) {
  PartFileReader reader(path);
  reader.GoToSummary();
  const std::vector<char> text = reader.Values<char>(reader.Number());
  try {
    return function(ParseJson(std::string(text.begin(), text.end())), &reader);
  } catch (const Json::exception&) {
    reader.Fail();
  }
}

}  // namespace

PartFileWriter::PartFileWriter(const fs::path& path, const std::string& key) : file_(path) {
  file_.Write(std::string(kMagic) + key + NumberBytes(0) + NumberBytes(0));
}

void PartFileWriter::Write(phi::FusedBlock block) {
  if (block.points.empty()) return;
  file_.Write(NumberBytes(block.points.size()) + NumberBytes(block.views.size()));
  file_.Write(BytesOf(block.points));
  file_.Write(BytesOf(block.view_counts));
  file_.Write(BytesOf(block.views));
}

void PartFileWriter::Commit() {
  const std::uint64_t offset = file_.bytes_written();
  const std::string json = DumpJson(ToJson(summary_), -1);
  file_.Write(NumberBytes(json.size()) + json);
  for (const PartImage& image : summary_.images) file_.Write(BytesOf(image.flags));
  file_.WriteAt(kNumbersOffset, NumberBytes(offset) + NumberBytes(file_.bytes_written()));
  file_.Commit();
}

bool IsPartFile(const fs::path& path, const std::string& key) {
  try {
    return PartFileReader(path).key() == key;
  } catch (const phi::InputError&) {
    return false;
  }
}

SceneFuser::Findings ReadPartFindings(const fs::path& path) {
  return WithSummary(path, [](const Json& json, PartFileReader*) { return FindingsFromJson(json); });
}

std::vector<PartImage> ReadPartImages(const fs::path& path) {
  return WithSummary(path, [](const Json& json, PartFileReader* reader) {
    std::vector<PartImage> images;
    for (const Json& image : json.at("images"))
      images.push_back(
          {image.at(0).get<int>(), reader->Values<std::uint8_t>(image.at(1).get<std::uint64_t>())});
    return images;
  });
}

std::map<int, FileIdentity> ReadPartConfidenceMaps(const fs::path& path) {
  return WithSummary(path, [](const Json& json, PartFileReader*) {
    std::map<int, FileIdentity> maps;
    for (const Json& map : json.at("confidence_maps")) maps[map.at(0)] = FileIdentity::FromText(map.at(1));
    return maps;
  });
}

void CopyPartPoints(const fs::path& path, CloudWriter* writer) {
  PartFileReader reader(path);
  while (!reader.IsAtSummary()) {
    const std::uint64_t num_points = reader.Number(), num_views = reader.Number();
    phi::FusedBlock block;
    block.points = reader.Values<phi::FusedPoint>(num_points);
    block.view_counts = reader.Values<std::uint32_t>(num_points);
    block.views = reader.Values<std::uint32_t>(num_views);
    writer->Write(std::move(block));
  }
}

}  // namespace colmap_ext

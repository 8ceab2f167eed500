#include "colmap_ext/fusion/cloud_files.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <system_error>

#include "colmap_ext/input_file.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxHeaderLines = 100;  // of PLY

// Whether a PLY file is there whose header has this line.
bool HasHeaderLine(const fs::path& path, const std::string& wanted) {
  std::ifstream file = OpenRegularFile(path);
  std::string line;
  for (int i = 0; i < kMaxHeaderLines && std::getline(file, line) && line != "end_header"; ++i) {
    if (i == 0 && line != "ply") return false;
    if (line == wanted) return true;
  }
  return false;
}

bool IsLasOfOurs(const fs::path& path) {
  std::ifstream file = OpenRegularFile(path);
  std::string header(kLasSystemAt + kLasSystem.size(), '\0');
  return file.read(header.data(), static_cast<std::streamsize>(header.size())) && header.starts_with("LASF") &&
         header.ends_with(kLasSystem);
}

void RemoveFile(const fs::path& file) {
  for (const fs::path& path : {fs::path(file.string() + ".vis"), file}) {
    std::error_code error;
    if (fs::is_directory(fs::symlink_status(path, error))) continue;
    fs::remove(path, error);
    if (error) phi::LogWarning(phi::AboutFile(path) + " is of an earlier cloud and cannot be removed (" + error.message() + "); remove it");
  }
}

}  // namespace

fs::path PartOfCloud(const fs::path& cloud, const std::string& addition) {
  return fs::path(cloud).replace_filename(cloud.stem().string() + addition + cloud.extension().string());
}

fs::path NumberedPart(const fs::path& cloud, std::size_t number) {
  return number == 1 ? cloud : PartOfCloud(cloud, "_" + std::to_string(number));
}

std::string NumberedPartComment(const fs::path& cloud) {
  std::string comment = "continues " + cloud.filename().string();
  std::replace_if(comment.begin(), comment.end(), [](unsigned char c) { return std::iscntrl(c); }, '?');
  return comment;
}

std::size_t EndOfNumberedParts(const fs::path& cloud, std::size_t first) {
  const std::string line = "comment " + NumberedPartComment(cloud);
  std::size_t end = first;
  while (HasHeaderLine(NumberedPart(cloud, end), line)) ++end;
  return end;
}

void RemoveNumberedParts(const fs::path& cloud, std::size_t first) {
  for (std::size_t end = EndOfNumberedParts(cloud, first); end > first; --end) RemoveFile(NumberedPart(cloud, end - 1));
}

void RemoveEarlierPart(const fs::path& part) {
  RemoveNumberedParts(part, 2);
  RemoveFile(part);
}

void RemoveEarlierCloud(const fs::path& cloud) {
  if (HasHeaderLine(cloud, "property uchar inferred") || IsLasOfOurs(cloud)) RemoveEarlierPart(cloud);
}

}  // namespace colmap_ext

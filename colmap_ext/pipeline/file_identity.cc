#include "colmap_ext/pipeline/file_identity.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string_view>
#include <system_error>

#include "colmap_ext/input_file.h"
#include "colmap_ext/text_stream.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

std::int64_t ChangedNs(const struct stat& status) {
  constexpr std::int64_t kPerSecond = 1000000000;
  return status.st_mtim.tv_sec * kPerSecond + status.st_mtim.tv_nsec;
}

std::string SampleOf(const std::filesystem::path& path) {
  ResultKey key;
  AddFileSample(path, &key);
  return key.Hex();
}

}  // namespace

std::string FileIdentity::Text() const {
  return std::to_string(num_bytes) + " " + std::to_string(changed_ns) + " " + sample;
}

FileIdentity FileIdentity::FromText(const std::string& text) {
  FileIdentity identity;
  TextInput fields(text);
  if (!(fields >> identity.num_bytes >> identity.changed_ns >> identity.sample)) {
    throw phi::InputError("'" + text + "' identifies no file");
  }
  return identity;
}

void AddFileSample(const std::filesystem::path& path, ResultKey* key) {
  constexpr std::int64_t kBlockBytes = 4096, kNumBlocks = 16;
  std::error_code missing;
  const auto file_size = std::filesystem::file_size(path, missing);
  const std::int64_t num_bytes = missing ? -1 : static_cast<std::int64_t>(file_size);
  key->Add(num_bytes);
  if (missing) return;
  std::ifstream file = OpenRegularFile(path);
  std::string block(kBlockBytes, '\0');
  const std::int64_t last_begin = std::max<std::int64_t>(num_bytes - kBlockBytes, 0);
  for (std::int64_t i = 0; i < kNumBlocks && file; ++i) {
    file.seekg(last_begin * i / (kNumBlocks - 1));
    file.read(block.data(), kBlockBytes);
    key->Add(std::string_view(block.data(), static_cast<std::size_t>(file.gcount())));
  }
}

FileIdentity IdentifyFile(const std::filesystem::path& path) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0) {
    throw phi::InputError(phi::AboutFile(path) + ": cannot be read: " + std::generic_category().message(errno));
  }
  return {static_cast<std::int64_t>(status.st_size), ChangedNs(status), SampleOf(path)};
}

bool IsOneOf(const std::filesystem::path& path, const std::vector<FileIdentity>& identities) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return false;
  std::string sample;  // read when it is asked for
  return std::any_of(identities.begin(), identities.end(), [&](const FileIdentity& identity) {
    if (identity.num_bytes != status.st_size) return false;
    if (identity.changed_ns == ChangedNs(status)) return true;
    if (sample.empty()) sample = SampleOf(path);
    return sample == identity.sample;
  });
}

}  // namespace colmap_ext

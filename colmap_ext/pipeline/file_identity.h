// What tells whether a file is still the one that was written here, or another program's under the same name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/result_key.h"

namespace colmap_ext {

struct FileIdentity {
  std::int64_t num_bytes = 0;
  std::int64_t changed_ns = 0;  // time of the last change of its content, since 1970
  std::string sample;           // hash over a sample of its bytes

  // "BYTES TIME HASH", as stereo/phimvs.json holds it.
  std::string Text() const;
  // Throws phi::InputError when `text` is not of that form.
  static FileIdentity FromText(const std::string& text);
};

// Adds the size of the file and a sample of its bytes: 16 blocks of 4 KiB, evenly spaced. Compressed files differ in
// nearly every byte, maps of the same size in most blocks; reading 10,000 of them whole would take longer than this is
// worth. A file that is not there adds a size of -1.
void AddFileSample(const std::filesystem::path& path, ResultKey* key);

// Throws phi::InputError when the file cannot be read.
FileIdentity IdentifyFile(const std::filesystem::path& path);

// Whether the file is one of these. Equal size and time decide at once; a copied workspace has other times, so that
// then the sample does. False for a file that is not there.
bool IsOneOf(const std::filesystem::path& path, const std::vector<FileIdentity>& identities);

}  // namespace colmap_ext

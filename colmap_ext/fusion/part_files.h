// The points of a part of a scene (fusion_parts.h) on disk, with what the parts after it need to know.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/fusion/scene_fuser.h"
#include "colmap_ext/pipeline/file_identity.h"

namespace colmap_ext {

// Of an image of the part: which of its pixels gave points, see FlagStore.
struct PartImage {
  int position = 0;
  std::vector<std::uint8_t> flags;
};

struct PartSummary {
  SceneFuser::Findings findings;
  std::vector<PartImage> images;
  std::map<int, FileIdentity> confidence_maps;  // by position: those that were written beside the part
};

// Under its name when Commit returns, whole or not at all. The format is this program's alone and lives for one job.
class PartFileWriter final : public CloudWriter {
 public:
  // key: of all that the part follows from.
  PartFileWriter(const std::filesystem::path& path, const std::string& key);
  void Write(phi::FusedBlock block) override;
  void SetSummary(PartSummary summary) { summary_ = std::move(summary); }
  void Commit() override;

 private:
  AtomicFile file_;
  PartSummary summary_;
};

// Whether the file is there, whole and of this key.
bool IsPartFile(const std::filesystem::path& path, const std::string& key);
// Throw phi::InputError where the file is damaged.
SceneFuser::Findings ReadPartFindings(const std::filesystem::path& path);
std::vector<PartImage> ReadPartImages(const std::filesystem::path& path);
std::map<int, FileIdentity> ReadPartConfidenceMaps(const std::filesystem::path& path);
void CopyPartPoints(const std::filesystem::path& path, CloudWriter* writer);

}  // namespace colmap_ext

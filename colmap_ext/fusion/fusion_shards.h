// Fusion by several processes: each fuses some parts (fusion_parts.h) into files of a folder beside the cloud, and one joins
// them. The cloud is the one that a single process makes.
#pragma once

#include <filesystem>

#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/pipeline/shard.h"

namespace colmap_ext {

// "fused.ply.parts" of "fused.ply".
std::filesystem::path PartsFolder(const std::filesystem::path& cloud);

struct ShardFusionReport {
  int num_parts = 0, num_made = 0;  // of the shard; made: by this process
  int num_waiting = 0;              // parts whose separators others have not made yet
  std::int64_t num_points = 0;      // of those made
  std::size_t num_failures = 0;     // images with damaged files
};

// The parts of one shard that can be made. Throws phi::UsageError for the paper's fusion, which has no parts.
ShardFusionReport FuseShard(const Workspace& workspace, const SceneFusionOptions& options,
                            const std::filesystem::path& parts_folder, const Shard& shard);

// All parts, those that are missing first, joined. Does not commit the writer; RemoveParts when it has.
SceneFusionReport JoinParts(const Workspace& workspace, const SceneFusionOptions& options,
                            const std::filesystem::path& parts_folder, CloudWriter* writer);
// The parts, and the folder where it holds nothing else.
void RemoveParts(const std::filesystem::path& parts_folder);

}  // namespace colmap_ext

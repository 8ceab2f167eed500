// What the commands of the same names do once their options are known; dense does them one after the other.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "colmap_ext/cli/fusion_options.h"
#include "colmap_ext/cli/stereo_options.h"
#include "colmap_ext/fusion/cloud_lock.h"
#include "colmap_ext/fusion/cloud_output.h"
#include "colmap_ext/fusion/handed_maps.h"
#include "colmap_ext/pipeline/shard.h"

namespace colmap_ext {

// `effective_options` goes into phimvs.json for the reader. `handed`, if not null, gets what is in memory for fusion. Returns
// the exit code.
int EstimateMaps(const StereoCommandOptions& options, const std::map<std::string, std::string>& effective_options,
                 const Shard& shard = {}, HandedMaps* handed = nullptr);

// output: resolved. `handed`: in memory, of the same workspace; the other maps are read from files. `lock`: of the output, if it is
// held already. Returns the exit code.
int FuseMaps(FusionCommandOptions options, const CloudOutput& output, HandedMaps handed = {}, std::unique_ptr<CloudLock> lock = {});

// Of all options of `dense` but places of files, for the report.
std::map<std::string, std::string> DefaultOptions();

}  // namespace colmap_ext

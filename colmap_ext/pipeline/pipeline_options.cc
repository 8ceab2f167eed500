#include "colmap_ext/pipeline/pipeline_options.h"

#include <algorithm>

#include "colmap_ext/byte_count.h"
#include "colmap_ext/memory_limit.h"

namespace colmap_ext {
namespace {

constexpr double kDefaultCacheShare = 0.5, kMaxDefaultCacheGigabytes = 32;

}  // namespace

phi::OptionList PipelineOptions::EstimationList() {
  phi::OptionList list;
  list.Add("PatchMatchStereo.depth_min", &depth_min, "Nearest depth; -1 = none")
      .Unit("world units")
      .ColmapDefault("-1");
  list.Add("PatchMatchStereo.depth_max", &depth_max, "Farthest depth; -1 = from the sparse points")
      .Unit("world units")
      .ColmapDefault("-1");
  return list;
}

phi::OptionList PipelineOptions::RunList() {
  constexpr const char* kChoosesStages = "it decides which stages there are";
  constexpr const char* kSameMaps = "the maps are the same";
  phi::OptionList list;
  list.Add("overwrite", &overwrite, "Replace maps that another program made").NotInKey(kSameMaps);
  list.Add("PatchMatchStereo.allow_missing_files", &allow_missing_files,
           "Leave out images whose file is missing; false = they fail (exit code 4), the others are done")
      .ColmapDefault("0")
      .NotInKey(kSameMaps);
  list.Add("PatchMatchStereo.geom_consistency", &geom_consistency,
           "true = filtered maps with filled holes (.geometric.bin); false = only photometric maps, nothing filled")
      .ColmapDefault("1")
      .NotInKey(kChoosesStages);
  list.Add("PatchMatchStereo.filter", &filter_maps, "Remove depths that other images do not confirm")
      .ColmapDefault("1")
      .NotInKey(kChoosesStages);
  list.Add("PhiStereo.write_cost_maps", &write_cost_maps, "Write the matching cost of each pixel to stereo/cost_maps")
      .NotInKey("an estimation's key says whether the cost is kept");
  list.Add("PhiStereo.compact_maps", &compact_maps,
           "Keep photometric and measured maps in stereo/compact_maps, in a quarter of the bytes, which phimvs alone reads; "
           "false = in COLMAP's form, those of earlier runs too")
      .NotInKey("the values are the same");
  list.Add("PatchMatchStereo.cache_size", &cache_gigabytes,
           "Memory for images and maps between the stages; -1 = half of what the process may use, at most 32")
      .Unit("GB")
      .ColmapDefault("32")
      .NotInKey(kSameMaps);
  return list;
}

phi::OptionList PipelineOptions::List() {
  phi::OptionList list;
  for (phi::OptionList part : {RunList(), view_selection.List(), EstimationList(), stereo.List(), filter.List(),
                               inference.List()}) {
    list.Append(std::move(part));
  }
  return list;
}

void PipelineOptions::SetMethod(const phi::Method& method) {
  view_selection.method = stereo.method = filter.method = inference.method = method;
}

std::int64_t PipelineOptions::CacheBytes() const {
  if (cache_gigabytes > 0) return ByteCount(cache_gigabytes * kBytesPerGigabyte);
  return ByteCount(std::min(kMaxDefaultCacheGigabytes * kBytesPerGigabyte,
                            kDefaultCacheShare * static_cast<double>(AvailableHostBytes())));
}

std::string PipelineOptions::Check() const {
  PipelineOptions copy = *this;
  for (const std::string& problem : {copy.EstimationList().Check(), copy.RunList().Check(), view_selection.Check(),
                                     stereo.Check(), filter.Check(), inference.Check()}) {
    if (!problem.empty()) return problem;
  }
  if (cache_gigabytes <= 0 && cache_gigabytes != -1)
    return "--PatchMatchStereo.cache_size must be more than 0 gigabytes, or -1";
  if ((depth_min >= 0) != (depth_max >= 0)) {
    return "--PatchMatchStereo.depth_min and --PatchMatchStereo.depth_max must be given together";
  }
  if (depth_min >= 0 && !(depth_min > 0 && depth_max > depth_min)) {
    return "--PatchMatchStereo.depth_min and --PatchMatchStereo.depth_max must satisfy 0 < depth_min < "
           "depth_max";
  }
  return "";
}

}  // namespace colmap_ext

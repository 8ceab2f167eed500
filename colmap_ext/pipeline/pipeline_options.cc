#include "colmap_ext/pipeline/pipeline_options.h"

#include <algorithm>

namespace colmap_ext {

int PipelineOptions::NumGuidedPasses() const {
  if (!geom_consistency) return 0;
  return std::min(num_guided_passes, stereo.num_iterations - 1);
}

std::string PipelineOptions::Check() const {
  for (const std::string& problem :
       {view_selection.Check(), stereo.Check(), filter.Check(), inference.Check()}) {
    if (!problem.empty()) return problem;
  }
  if (num_guided_passes < 0 || num_guided_passes > 10) {
    return "--PhiStereo.num_guided_passes is " + std::to_string(num_guided_passes) +
           ", but must be between 0 and 10";
  }
  if (cache_bytes <= 0) return "--PatchMatchStereo.cache_size must be more than 0 gigabytes";
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

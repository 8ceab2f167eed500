// What patch_match_stereo does with a workspace, beside the options of the algorithm's own stages.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "phi/options.h"

namespace colmap_ext {

struct PipelineOptions {
  phi::ViewSelectionOptions view_selection;
  phi::StereoOptions stereo;
  phi::FilterOptions filter;
  phi::InferenceOptions inference;

  bool geom_consistency =
      true;  // --PatchMatchStereo.geom_consistency: false ends with (filtered) photometric maps
  bool filter_maps = true;           // --PatchMatchStereo.filter
  int num_guided_passes = 0;         // --PhiStereo.num_guided_passes, see NumGuidedPasses
  double depth_min = -1;             // --PatchMatchStereo.depth_min, world units; < 0: from the sparse points
  double depth_max = -1;             // --PatchMatchStereo.depth_max, world units; < 0: from the sparse points
  bool write_cost_maps = false;      // --PhiStereo.write_cost_maps
  bool overwrite = false;            // --overwrite: replace maps that another program made
  bool allow_missing_files = false;  // --PatchMatchStereo.allow_missing_files: missing images are left out
  std::int64_t cache_bytes = std::int64_t{32}
                             << 30;  // --PatchMatchStereo.cache_size: images and maps in memory

  // Estimations after the first one, one iteration each, that start from all views' maps and are guided by them. They
  // are part of num_iterations. None where only photometric maps are wanted.
  int NumGuidedPasses() const;

  // Whether later stages read the matching cost of the estimate.
  bool NeedsCost() const { return write_cost_maps || filter.max_cost < 2; }
  std::string Check() const;
};

}  // namespace colmap_ext

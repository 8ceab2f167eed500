// What patch_match_stereo does with a workspace, beside the options of the algorithm's own stages.
#pragma once

#include <cstdint>
#include <string>

#include "phi/options.h"

namespace colmap_ext {

struct PipelineOptions {
  phi::ViewSelectionOptions view_selection;
  phi::StereoOptions stereo;
  phi::FilterOptions filter;
  phi::InferenceOptions inference;

  bool geom_consistency = true;  // false ends with (filtered) photometric maps
  bool filter_maps = true;
  double depth_min = -1;  // world units; < 0: none
  double depth_max = -1;  // likewise; < 0: from the sparse points
  bool write_cost_maps = false;
  bool compact_maps = false;  // of what later stages alone read: compact_map.h
  bool overwrite = false;            // replaces maps that another program made
  bool allow_missing_files = false;  // missing images are left out
  double cache_gigabytes = -1;       // images and maps in memory; see CacheBytes

  // The part of an estimation's options that is not in phi::StereoOptions.
  phi::OptionList EstimationList();
  // All others of this struct itself.
  phi::OptionList RunList();
  // Every option of the stages, this struct's included.
  phi::OptionList List();

  // Every stage's.
  void SetMethod(const phi::Method& method);
  // -1: half of the memory that the process may use, at most 32 GB.
  std::int64_t CacheBytes() const;
  // Both ends or neither (Check).
  bool GivesDepthRange() const { return depth_min > 0; }
  // Whether later stages read the matching cost of the estimate.
  bool NeedsCost() const { return write_cost_maps || filter.UsesCost(); }
  std::string Check() const;
};

}  // namespace colmap_ext

// The stages of a run as a chain: each makes one result per image from the maps of the stage before it, its own image's and
// often the sources'.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "colmap_ext/pipeline/pipeline_options.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

enum class StageKind {
  kEstimate,  // depth and normals by patch matching
  kShare,     // takes hypotheses of other images that match better
  kFilter,    // keeps what other views confirm
  kInfer,     // fills holes with plane hypotheses
  kPublish,   // the map of the stage before under another name
};

struct Stage {
  StageKind kind = StageKind::kEstimate;
  std::string result = {};   // the kind of map it makes: middle part of file names, name in phimvs.json
  std::string options = {};  // what its results depend on, as text
  bool is_output = true;     // belongs into the finished workspace; else made where a later stage asks for it
  bool judges_measurements = false;  // of a filter: it judges, too (phi/filtering/judgement.h)
  bool restores_measured = false;  // of a filter after inference: what the measured map has, where inference's correction was not confirmed
  bool transient = false;  // lives in memory and is not recorded
  bool has_mask = false;   // its maps have states: phi/measurement.h
  bool is_rounded = false;  // its maps are what compact files give back (compact_codes.h), in whatever form they are kept
  bool reads_source_maps = false;
  bool reads_maps_around_sources = false;  // those that the sources' own turn at the stage reads, too; the stage before is output
  double weight = 1;                 // expected time of a task, relative to an estimation
  std::string_view key_prefix = {};  // of its results' keys: tells what made them
};

// The begin of the keys of what hole_filler makes. patch_match_stereo gives no such key and so makes its own geometric
// maps again when it runs next.
inline constexpr std::string_view kFillingKey = "hole_filler ";

// What belongs into no finished workspace, whatever the options.
inline constexpr std::string_view kIntermediateKinds[] = {kRaw, kShared, kInferred};

// What a stage does, for the progress line: "estimating".
std::string ActivityName(StageKind kind);

std::vector<Stage> BuildStages(const PipelineOptions& options);
// Of a run that begins with measured maps: those, then what fills them.
std::vector<Stage> BuildFillingStages(const PipelineOptions& options);
// The kind of map that the estimation makes.
std::string EstimateKind(const PipelineOptions& options);

}  // namespace colmap_ext

// Fuses all images of a workspace and hands the points on as they are made.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/fusion/fusion_backend.h"
#include "colmap_ext/fusion/fusion_map_reader.h"
#include "colmap_ext/workspace.h"
#include "phi/fusion/fusion_options.h"

namespace colmap_ext {

struct SceneFusionOptions {
  phi::FusionOptions rule;
  FusionInput input;
  std::optional<phi::BoundingBox> box;
  FusionBackend backend = FusionBackend::kAuto;
  FusionGpus gpus;
  int num_threads = -1;                  // <= 0: all
  int max_neighbors = 50;                // images that each image is compared with; -1: all
  double max_memory_gb = 0;              // 0: half of what the process may use
  std::filesystem::path scratch_folder;  // for state that does not fit in memory
  bool write_confidence_maps = false;    // of each image that is fused, into stereo/confidence_maps
  int max_part_images = 256;  // see fusion_parts.h; the order of images follows from it, and with it the cloud

  // All but the box and the GPU, the rule's and the input's included.
  phi::OptionList List();
  std::int64_t MemoryBytes() const;  // of max_memory_gb
  // An empty string, or one sentence naming option, value and rule.
  std::string Check() const;
};

struct SceneFusionReport {
  int num_images = 0, num_images_without_maps = 0;
  std::int64_t num_map_reads = 0;
  std::int64_t num_points = 0;
  phi::OutcomeCounts outcomes;                 // pixels
  std::vector<double> noise_of_smoothed_maps;  // standard deviation over depth, see map_noise.h
  std::vector<phi::Message> failures;  // why images with damaged files were left out, one message each
};

// Throws phi::InputError when no image has maps that can be read. Does not commit the writer.
SceneFusionReport FuseScene(const Workspace& workspace, const SceneFusionOptions& options,
                            CloudWriter* writer);
// Those in memory before those in files. `handed` is used up, and first trimmed to what the fused images leave of the memory.
SceneFusionReport FuseScene(const Workspace& workspace, HandedMaps* handed, const SceneFusionOptions& options,
                            CloudWriter* writer);
// The same of maps that need not be in files; options.input does not matter then.
SceneFusionReport FuseScene(const Workspace& workspace, const FusionMapSource& maps,
                            const SceneFusionOptions& options, CloudWriter* writer);

}  // namespace colmap_ext

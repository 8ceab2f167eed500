#include "colmap_ext/cli/stereo_options.h"

#include <algorithm>

#include "colmap_ext/byte_count.h"
#include "colmap_ext/cli/option_ranges.h"
#include "colmap_ext/pipeline/run_summary.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

constexpr double kDefaultCacheShare = 0.5;  // of the memory that the process may use

}  // namespace

void StereoCommandOptions::Register(OptionParser* parser) {
  parser->Add("workspace_path", &workspace.path, "Folder that colmap image_undistorter wrote").Required();
  parser->Add("workspace_format", &workspace.format, "Format of the workspace {COLMAP}")
      .ColmapDefault("COLMAP");
  parser->AddColmapOnly("pmvs_option_name", "option-all", "PMVS workspaces are not supported");
  parser->Add("config_path", &config_path, "Instead of stereo/patch-match.cfg in the workspace")
      .ColmapDefault("");
  parser->Add("overwrite", &pipeline.overwrite, "Replace maps that another program left in the workspace");
  RegisterPatchMatch(parser);
  RegisterFilter(parser);
  RegisterPhi(parser);
  RegisterPreset(parser);
}

void StereoCommandOptions::RegisterPatchMatch(OptionParser* parser) {
  phi::StereoOptions& stereo = pipeline.stereo;
  parser
      ->Add("PatchMatchStereo.max_image_size", &workspace.max_image_size,
            "Longest side of the images that the stereo works on; -1 = as they are")
      .Unit("pixels")
      .ColmapDefault("-1");
  parser
      ->Add("PatchMatchStereo.gpu_index", &backend.gpu_index, "GPUs to use: -1 = all, or a list such as 0,1")
      .ColmapDefault("-1");
  parser->Add("PatchMatchStereo.depth_min", &pipeline.depth_min, "Nearest depth; -1 = from the sparse points")
      .Unit("world units")
      .ColmapDefault("-1");
  parser
      ->Add("PatchMatchStereo.depth_max", &pipeline.depth_max, "Farthest depth; -1 = from the sparse points")
      .Unit("world units")
      .ColmapDefault("-1");
  parser->Add("PatchMatchStereo.window_radius", &stereo.window_radius, "Half the side of the matching window")
      .Unit("pixels")
      .ColmapDefault("5");
  parser->Add("PatchMatchStereo.window_step", &stereo.window_step, "Distance of the samples in the window")
      .Unit("pixels")
      .ColmapDefault("1");
  parser
      ->Add("PatchMatchStereo.num_iterations", &stereo.num_iterations, "Rounds of propagation and refinement")
      .ColmapDefault("5");
  parser
      ->Add("PatchMatchStereo.min_triangulation_angle", &pipeline.view_selection.min_triangulation_angle,
            "Smallest angle between a selected source view and the reference")
      .Unit("degrees")
      .ColmapDefault("1");
  parser
      ->Add("PatchMatchStereo.geom_consistency", &pipeline.geom_consistency,
            "Make geometric maps: filtered, holes filled, filtered again; false = (filtered) photometric "
            "maps only")
      .ColmapDefault("1");
  parser
      ->Add("PatchMatchStereo.cache_size", &cache_gigabytes,
            "Memory for images and maps between the stages; when unset, half of the machine's at most")
      .Unit("GB")
      .ColmapDefault("32");
  parser
      ->Add("PatchMatchStereo.allow_missing_files", &pipeline.allow_missing_files,
            "Leave out images whose file is missing; false = that is a failure (exit code 4)")
      .ColmapDefault("0");
  parser->Add("PatchMatchStereo.num_threads", &backend.num_threads, "Threads of the CPU backend; -1 = all")
      .ColmapDefault("-1");
  for (const auto& [name, colmap_default] : {std::pair{"sigma_spatial", "-1"},
                                             {"sigma_color", "0.2"},
                                             {"num_samples", "15"},
                                             {"ncc_sigma", "0.6"},
                                             {"incident_angle_sigma", "0.9"}}) {
    parser->AddColmapOnly(std::string("PatchMatchStereo.") + name, colmap_default,
                          "the cost and the choice of views are others than COLMAP's");
  }
  for (const auto& [name, colmap_default] :
       {std::pair{"geom_consistency_regularizer", "0.3"}, {"geom_consistency_max_cost", "3"}}) {
    parser->AddColmapOnly(std::string("PatchMatchStereo.") + name, colmap_default,
                          "geometric consistency is a filter here, and not part of the matching cost");
  }
  parser->AddColmapOnly("PatchMatchStereo.write_consistency_graph", "0",
                        "no consistency graph is written; fusion does not read it");
}

void StereoCommandOptions::RegisterFilter(OptionParser* parser) {
  phi::FilterOptions& filter = pipeline.filter;
  parser->Add("PatchMatchStereo.filter", &pipeline.filter_maps, "Remove what other views do not confirm")
      .ColmapDefault("1");
  parser
      ->Add("PatchMatchStereo.filter_min_ncc", &filter_min_ncc,
            "Smallest matching score (1 - cost) of a kept pixel; -1 = off; never applies to filled pixels")
      .ColmapDefault("0.1");
  parser
      ->Add("PatchMatchStereo.filter_min_triangulation_angle", &filter.min_triangulation_angle,
            "Smallest angle at the surface that one confirming view must reach; 0 = off")
      .Unit("degrees")
      .ColmapDefault("3");
  parser
      ->Add("PatchMatchStereo.filter_min_num_consistent", &filter.min_num_consistent,
            "Fewest source views that confirm a kept pixel")
      .ColmapDefault("2");
  parser
      ->Add("PatchMatchStereo.filter_geom_consistency_max_cost", &filter.max_reprojection_error,
            "Largest forward-backward reprojection error of a confirming view")
      .Unit("pixels")
      .ColmapDefault("1");
  parser->Add("PhiStereo.filter_max_relative_depth_error", &filter.max_relative_depth_error,
              "Largest depth difference of a confirming view, relative to depth");
  parser
      ->Add("PhiStereo.filter_max_depth_error", &filter.max_depth_error,
            "The same as a length, in place of the relative one; 0 = off")
      .Unit("world units");
  parser
      ->Add("PhiStereo.filter_max_normal_error", &filter.max_normal_error,
            "Largest angle between the normals of a confirming view")
      .Unit("degrees");
}

void StereoCommandOptions::RegisterPhi(OptionParser* parser) {
  parser->AddChoice<BackendKind>(
      "PhiStereo.backend", &backend.kind,
      {{"auto", BackendKind::kAuto}, {"cuda", BackendKind::kCuda}, {"cpu", BackendKind::kCpu}},
      "Where the stereo runs; auto = on a GPU where one works");
  parser
      ->Add("PhiStereo.device_memory", &backend.device_memory_gigabytes,
            "Memory to use on each GPU; -1 = what is free. With less than images need: slower, same result")
      .Unit("GB");
  parser->AddChoice<phi::Quality>("PhiStereo.quality", &pipeline.stereo.quality,
                                  {{"standard", phi::Quality::kStandard}, {"fast", phi::Quality::kFast}},
                                  "fast = from reduced images to the full size, with few iterations there");
  parser->AddChoice<phi::Formulas>("PhiStereo.formulas", &pipeline.stereo.formulas,
                                   {{"robust", phi::Formulas::kRobust}, {"paper", phi::Formulas::kPaper}},
                                   "paper = the paper's equations; --preset paper sets this and its values");
  parser->Add("PhiStereo.num_source_views", &pipeline.view_selection.num_source_views,
              "Most source views that __auto__ in patch-match.cfg selects");
  parser
      ->Add("PhiStereo.min_displacement", &pipeline.view_selection.min_displacement,
            "Least mean shift of shared points in a source view where their depth changes by 0.2 %")
      .Unit("pixels");
  parser->Add("PhiStereo.num_guided_passes", &pipeline.num_guided_passes,
              "How many of the iterations are guided by the maps of all views");
  parser->Add("PhiStereo.num_window_levels", &pipeline.stereo.num_window_levels,
              "1 + how often a window without texture may double");
  parser->Add("PhiStereo.write_cost_maps", &pipeline.write_cost_maps,
              "Write the matching cost to stereo/cost_maps");
  phi::InferenceOptions& inference = pipeline.inference;
  parser->AddChoice<phi::InferenceMode>(
      "PhiInference.mode", &inference.mode,
      {{"off", phi::InferenceMode::kOff},
       {"min_cost", phi::InferenceMode::kMinCost},
       {"mrf", phi::InferenceMode::kMrf}},
      "How holes are filled: not, by the cheapest plane, or by a random field");
  parser->Add("PhiInference.min_num_consistent", &pipeline.filter.min_num_consistent_inferred,
              "Source views that must confirm an inferred pixel");
  parser->Add("PhiInference.num_passes", &inference.num_passes, "Passes of message passing over the field");
  parser->Add("PhiInference.truncation", &inference.truncation,
              "Relative depth difference from which neighbours count as different surfaces");
}

// Every value that the paper names, those too that are defaults today.
void StereoCommandOptions::RegisterPreset(OptionParser* parser) {
  parser->AddPreset("paper", {{"PhiStereo.formulas", "paper"},
                              {"PhiStereo.num_source_views", "8"},
                              {"PhiStereo.min_displacement", "0.1"},
                              {"PatchMatchStereo.min_triangulation_angle", "0"},
                              {"PatchMatchStereo.window_radius", "7"},  // r_orig; r_now is 5
                              {"PatchMatchStereo.window_step", "1.4"},
                              {"PatchMatchStereo.num_iterations", "8"},
                              {"PhiStereo.num_guided_passes", "0"},
                              {"PhiStereo.num_window_levels", "1"},
                              {"PatchMatchStereo.geom_consistency", "true"},
                              {"PatchMatchStereo.filter", "true"},
                              {"PatchMatchStereo.filter_min_ncc", "-1"},
                              {"PatchMatchStereo.filter_min_triangulation_angle", "0"},
                              {"PatchMatchStereo.filter_min_num_consistent", "2"},
                              {"PatchMatchStereo.filter_geom_consistency_max_cost", "1"},
                              {"PhiStereo.filter_max_depth_error", "0.02"},
                              {"PhiStereo.filter_max_normal_error", "30"},
                              {"PhiInference.mode", "mrf"},
                              {"PhiInference.min_num_consistent", "2"},
                              {"PhiInference.num_passes", "1"},
                              {"PhiInference.truncation", "1"}});
}

void StereoCommandOptions::ApplyFormulas(const OptionParser& parser) {
  const phi::Formulas formulas = pipeline.stereo.formulas;
  pipeline.view_selection.formulas = formulas;
  pipeline.filter.formulas = formulas;
  pipeline.inference.formulas = formulas;
  if (formulas == phi::Formulas::kPaper) {
    parser.WarnWithoutEffect({"PhiStereo.quality"},
                             "with --PhiStereo.formulas paper all iterations are at full size");
  }
  // A relative tolerance that somebody chose goes before the preset's length.
  const bool is_relative = parser.IsSet("PhiStereo.filter_max_relative_depth_error") &&
                           !parser.IsSet("PhiStereo.filter_max_depth_error");
  if (is_relative && pipeline.filter.max_depth_error > 0) {
    phi::LogInfo(
        "--PhiStereo.filter_max_relative_depth_error goes before the preset's "
        "--PhiStereo.filter_max_depth_error");
    pipeline.filter.max_depth_error = 0;
  }
}

void StereoCommandOptions::Finish(const OptionParser& parser) {
  CheckNumThreads("PatchMatchStereo.num_threads", backend.num_threads);
  CheckMaxImageSize("PatchMatchStereo.max_image_size", workspace.max_image_size);
  ApplyFormulas(parser);
  pipeline.stereo.seed = parser.random_seed();
  if (filter_min_ncc > 1) throw phi::UsageError("--PatchMatchStereo.filter_min_ncc must be at most 1");
  pipeline.filter.max_cost = filter_min_ncc > -1 ? 1 - filter_min_ncc : 2;
  double cache_bytes = cache_gigabytes * kBytesPerGigabyte;
  if (!parser.IsSet("PatchMatchStereo.cache_size")) {
    cache_bytes = std::min(cache_bytes, kDefaultCacheShare * static_cast<double>(AvailableHostBytes()));
    phi::LogDebug("cache of " + std::to_string(cache_bytes / kBytesPerGigabyte) + " GB");
  }
  pipeline.cache_bytes = ByteCount(cache_bytes);
  const std::string problem = pipeline.Check();
  if (!problem.empty()) throw phi::UsageError(problem);
}

}  // namespace colmap_ext

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
  RegisterWorkspace(parser);
  RegisterDevices(parser);
  RegisterEstimation(parser);
  RegisterWindow(parser);
  RegisterFilter(parser);
  RegisterInference(parser);
  RegisterColmapOnly(parser);
  RegisterPreset(parser);
}

void StereoCommandOptions::RegisterFilling(OptionParser* parser) {
  RegisterWorkspace(parser);
  RegisterDevices(parser);
  RegisterWindow(parser);
  RegisterFilter(parser);
  RegisterInference(parser);
  RegisterPreset(parser);
}

void StereoCommandOptions::RegisterWorkspace(OptionParser* parser) {
  parser
      ->Add("workspace_path", &workspace.path,
            "Folder that colmap image_undistorter wrote, or the one above it")
      .Required();
  parser->Add("workspace_format", &workspace.format, "Format of the workspace {COLMAP}")
      .ColmapDefault("COLMAP");
  parser->AddColmapOnly("pmvs_option_name", "option-all", "PMVS workspaces are not supported");
  parser
      ->Add("config_path", &config_path,
            "List of images and their source images; default: stereo/patch-match.cfg of the workspace")
      .ColmapDefault("");
  parser->Add("overwrite", &pipeline.overwrite, "Replace maps that another program made");
  parser
      ->Add("PatchMatchStereo.max_image_size", &workspace.max_image_size,
            "Work on smaller images: longest side; -1 = full size")
      .Unit("pixels")
      .ColmapDefault("-1");
  parser->Add("PhiStereo.mask_path", &workspace.mask_path,
              "Folder of masks named <image name>.png; where a mask is 0 the image is left out");
  parser
      ->Add("PatchMatchStereo.allow_missing_files", &pipeline.allow_missing_files,
            "Leave out images whose file is missing; false = they fail (exit code 4), the others are done")
      .ColmapDefault("0");
  parser
      ->Add("PatchMatchStereo.min_triangulation_angle", &pipeline.view_selection.min_triangulation_angle,
            "Smallest angle between an image and a source image that __auto__ selects")
      .Unit("degrees")
      .ColmapDefault("1");
  parser->Add("PhiStereo.num_source_views", &pipeline.view_selection.num_source_views,
              "Most source images that __auto__ in patch-match.cfg selects");
  parser
      ->Add("PhiStereo.min_displacement", &pipeline.view_selection.min_displacement,
            "Least mean shift of shared points in a source view where their depth changes by 0.2 %")
      .Unit("pixels");
  parser->AddChoice<phi::Formulas>("PhiStereo.formulas", &pipeline.stereo.formulas,
                                   {{"robust", phi::Formulas::kRobust}, {"paper", phi::Formulas::kPaper}},
                                   "paper = the paper's equations; --preset paper sets this and its values");
}

void StereoCommandOptions::RegisterDevices(OptionParser* parser) {
  parser->AddChoice<BackendKind>(
      "PhiStereo.backend", &backend.kind,
      {{"auto", BackendKind::kAuto}, {"cuda", BackendKind::kCuda}, {"cpu", BackendKind::kCpu}},
      "Where to compute; auto = on the GPUs, or on the CPU where there is none");
  parser
      ->Add("PatchMatchStereo.gpu_index", &backend.gpu_index, "GPUs to use: -1 = all, or a list such as 0,1")
      .ColmapDefault("-1");
  parser
      ->Add("PhiStereo.device_memory", &backend.device_memory_gigabytes,
            "Memory to use on each GPU; -1 = what is free. With little the run is slower, the maps are the "
            "same")
      .Unit("GB");
  parser->Add("PatchMatchStereo.num_threads", &backend.num_threads, "Threads of the CPU; -1 = all cores")
      .ColmapDefault("-1");
  parser
      ->Add("PatchMatchStereo.cache_size", &cache_gigabytes,
            "Memory for images and maps between the stages; when not given, at most half of the machine's")
      .Unit("GB")
      .ColmapDefault("32");
}

void StereoCommandOptions::RegisterEstimation(OptionParser* parser) {
  phi::StereoOptions& stereo = pipeline.stereo;
  parser
      ->Add("PatchMatchStereo.geom_consistency", &pipeline.geom_consistency,
            "true = filtered maps with filled holes (.geometric.bin); false = only photometric maps, nothing "
            "filled")
      .ColmapDefault("1");
  parser
      ->Add("PatchMatchStereo.depth_min", &pipeline.depth_min, "Nearest depth; -1 = from the sparse points")
      .Unit("world units")
      .ColmapDefault("-1");
  parser
      ->Add("PatchMatchStereo.depth_max", &pipeline.depth_max, "Farthest depth; -1 = from the sparse points")
      .Unit("world units")
      .ColmapDefault("-1");
  parser
      ->Add("PatchMatchStereo.num_iterations", &stereo.num_iterations, "Rounds of propagation and refinement")
      .ColmapDefault("5");
  parser
      ->Add("PatchMatchStereo.filter", &pipeline.filter_maps,
            "Remove depths that other images do not confirm")
      .ColmapDefault("1");
  parser
      ->Add("PatchMatchStereo.filter_min_ncc", &filter_min_ncc,
            "Smallest matching score (1 - cost) of a kept pixel; -1 = off. Filled pixels are not asked")
      .ColmapDefault("0.1");
  parser->AddChoice<phi::Quality>("PhiStereo.quality", &stereo.quality,
                                  {{"standard", phi::Quality::kStandard}, {"fast", phi::Quality::kFast}},
                                  "fast = fewer iterations at full size: less detail, less time");
  parser->Add("PhiStereo.num_guided_passes", &pipeline.num_guided_passes,
              "How many of the iterations, the last ones, are guided by the other images' maps");
  parser->Add("PhiStereo.num_window_levels", &stereo.num_window_levels,
              "1 + how often the window may double where there is no texture");
  parser->Add("PhiStereo.write_cost_maps", &pipeline.write_cost_maps,
              "Write the matching cost of each pixel to stereo/cost_maps");
}

void StereoCommandOptions::RegisterWindow(OptionParser* parser) {
  parser
      ->Add("PatchMatchStereo.window_radius", &pipeline.stereo.window_radius,
            "Half the side of the matching window")
      .Unit("pixels")
      .ColmapDefault("5");
  parser
      ->Add("PatchMatchStereo.window_step", &pipeline.stereo.window_step,
            "Distance between the window's samples")
      .Unit("pixels")
      .ColmapDefault("1");
}

void StereoCommandOptions::RegisterFilter(OptionParser* parser) {
  phi::FilterOptions& filter = pipeline.filter;
  parser
      ->Add("PatchMatchStereo.filter_min_triangulation_angle", &filter.min_triangulation_angle,
            "Smallest angle at the surface point that one confirming image must reach; 0 = off")
      .Unit("degrees")
      .ColmapDefault("3");
  parser
      ->Add("PatchMatchStereo.filter_min_num_consistent", &filter.min_num_consistent,
            "Fewest source images that confirm a measured pixel")
      .ColmapDefault("2");
  parser
      ->Add("PatchMatchStereo.filter_geom_consistency_max_cost", &filter.max_reprojection_error,
            "Largest forward-backward reprojection error of a confirming image")
      .Unit("pixels")
      .ColmapDefault("1");
  parser->Add("PhiStereo.filter_max_relative_depth_error", &filter.max_relative_depth_error,
              "Largest difference in depth of a confirming image, relative to depth");
  parser
      ->Add("PhiStereo.filter_max_depth_error", &filter.max_depth_error,
            "The same as a length, in place of the relative one; 0 = off")
      .Unit("world units");
  parser
      ->Add("PhiStereo.filter_max_normal_error", &filter.max_normal_error,
            "Largest angle between the normals of an image and of one that confirms it")
      .Unit("degrees");
}

void StereoCommandOptions::RegisterInference(OptionParser* parser) {
  phi::InferenceOptions& inference = pipeline.inference;
  parser->AddChoice<phi::InferenceMode>(
      "PhiInference.mode", &inference.mode,
      {{"off", phi::InferenceMode::kOff},
       {"min_cost", phi::InferenceMode::kMinCost},
       {"mrf", phi::InferenceMode::kMrf}},
      "Filling of holes: off = none; min_cost = each pixel takes the plane that matches best; mrf = "
      "neighbours choose their planes together");
  parser->Add("PhiInference.min_num_consistent", &pipeline.filter.min_num_consistent_inferred,
              "Fewest source images that confirm an inferred pixel");
  parser->Add("PhiInference.num_passes", &inference.num_passes, "Rounds of the neighbours' choice (mrf)");
  parser->Add("PhiInference.truncation", &inference.truncation,
              "Relative difference in depth from which neighbours count as different surfaces (mrf)");
}

void StereoCommandOptions::RegisterColmapOnly(OptionParser* parser) {
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
  workspace.path = FindWorkspaceFolder(workspace.path);
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

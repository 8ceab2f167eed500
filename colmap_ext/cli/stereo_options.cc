#include "colmap_ext/cli/stereo_options.h"

#include <utility>

#include "colmap_ext/workspace_folder.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {

void StereoCommandOptions::Register(OptionParser* parser) {
  RegisterInput(parser);
  parser->Append(pipeline.List());
  RegisterColmapOnly(parser);
  RegisterPreset(parser);
}

void StereoCommandOptions::RegisterFilling(OptionParser* parser) {
  RegisterInput(parser);
  phi::OptionList list;
  list.Append(pipeline.RunList(),
              {"overwrite", "PatchMatchStereo.allow_missing_files", "PatchMatchStereo.cache_size"});
  list.Append(pipeline.stereo.List(), {"PhiStereo.formulas", "PhiStereo.rules",
                                       "PatchMatchStereo.window_radius", "PatchMatchStereo.window_step"});
  list.Append(pipeline.EstimationList());  // the range of depths bounds what is filled, too
  list.Append(pipeline.view_selection.List());
  list.Append(pipeline.filter.List());
  list.Append(pipeline.inference.List());
  parser->Append(std::move(list));
  RegisterPreset(parser);
}

void StereoCommandOptions::RegisterInput(OptionParser* parser) {
  parser->Append(workspace.List());
  parser->AddColmapOnly("pmvs_option_name", "option-all", "PMVS workspaces are not supported");
  parser
      ->Add("config_path", &config_path,
            "List of images and their source images; default: stereo/patch-match.cfg of the workspace")
      .ColmapDefault("")
      .NotInKey("the keys hold the source images");
  parser->Append(backend.List());
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
  parser->AddPaperPreset({{"PhiStereo.formulas", "paper"},
                          {"PhiStereo.num_source_views", "8"},
                          {"PhiStereo.num_witness_views", "8"},
                          {"PhiStereo.min_displacement", "0.1"},
                          {"PatchMatchStereo.min_triangulation_angle", "0"},
                          {"PatchMatchStereo.window_radius", "7"},  // r_orig; r_now is 5
                          {"PatchMatchStereo.window_step", "1.4"},
                          {"PatchMatchStereo.num_iterations", "8"},
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
  pipeline.SetMethod(pipeline.stereo.method);
  if (pipeline.stereo.method.formulas == phi::Formulas::kPaper) {
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
  ApplyFormulas(parser);
  pipeline.stereo.seed = parser.random_seed();
  const std::string problem = pipeline.Check();
  if (!problem.empty()) throw phi::UsageError(problem);
}

}  // namespace colmap_ext

#include "colmap_ext/cli/fusion_options.h"

#include "colmap_ext/fusion/bounding_box_file.h"
#include "colmap_ext/fusion/fusion_map_reader.h"
#include "colmap_ext/workspace_folder.h"
#include "phi/base/error.h"

namespace colmap_ext {

void FusionCommandOptions::Register(OptionParser* parser) {
  parser->Append(workspace.FolderList());
  parser->AddColmapOnly("pmvs_option_name", "option-all", "PMVS workspaces are not read");
  RegisterFusion(parser);
}

void FusionCommandOptions::RegisterFusion(OptionParser* parser) {
  parser->Append(fusion.List());
  parser->Add("bbox_path", &bbox_path, "File with the two corners of the box to fuse, world coordinates");
  parser
      ->Add("StereoFusion.max_image_size", &workspace.max_image_size,
            "Work on smaller maps: longest side; -1 = full size")
      .Unit("pixels")
      .AtLeast(-1);
  parser->AddColmapOnly("StereoFusion.max_traversal_depth", "100", "points are not found by traversal");
  parser->AddColmapOnly("StereoFusion.use_cache", "0",
                        "maps are always cached, within --PhiFusion.max_memory_gb");
  parser->AddColmapOnly("StereoFusion.cache_size", "32", "--PhiFusion.max_memory_gb bounds the memory");
  // Every value that the paper names or that stands for its "all".
  parser->AddPaperPreset({{"PhiFusion.formulas", "paper"},
                          {"StereoFusion.min_num_pixels", "1"},
                          {"StereoFusion.max_num_pixels", "10000"},
                          {"StereoFusion.max_depth_error", "0.01"},
                          {"StereoFusion.check_num_images", "-1"}});
}

void FusionCommandOptions::Finish(const OptionParser& parser) {
  workspace.path = FindWorkspaceFolder(workspace.path);
  if (!fusion.rule.method.rules.IsOn(phi::Rule::kRayAgreement)) fusion.rule.method.formulas = phi::Formulas::kPaper;
  if (fusion.rule.method.formulas == phi::Formulas::kPaper) {
    parser.WarnWithoutEffect({"StereoFusion.max_reproj_error", "StereoFusion.max_normal_error",
                              "PhiFusion.max_normal_error_in_holes", "PhiFusion.min_support",
                              "PhiFusion.min_support_inferred", "PhiFusion.max_conflicts"},
                             "with --PhiFusion.formulas paper points agree by their distance alone");
  }
  fusion.input.downsize = workspace.max_image_size > 0;
  if (const std::string problem = fusion.Check(); !problem.empty()) throw phi::UsageError(problem);
  const std::filesystem::path& masks = fusion.input.mask_path;
  if (!masks.empty() && !std::filesystem::is_directory(masks)) throw phi::InputError(NoFolderOfFusionMasks(masks));
  if (!bbox_path.empty()) fusion.box = ReadBoundingBox(bbox_path);
}

}  // namespace colmap_ext

#include "colmap_ext/cli/fusion_options.h"

#include "colmap_ext/cli/option_ranges.h"
#include "colmap_ext/fusion/bounding_box_file.h"
#include "phi/base/error.h"

namespace colmap_ext {

void FusionCommandOptions::Register(OptionParser* parser) {
  parser
      ->Add("workspace_path", &workspace.path,
            "Folder that colmap image_undistorter wrote, or the one above it")
      .Required();
  parser->Add("workspace_format", &workspace.format, "Only COLMAP");
  parser->AddColmapOnly("pmvs_option_name", "option-all", "PMVS workspaces are not read");
  RegisterFusion(parser);
}

void FusionCommandOptions::RegisterFusion(OptionParser* parser) {
  parser->AddChoice<std::string>("input_type", &fusion.input.kind,
                                 {{"geometric", std::string(kGeometric)},
                                  {"photometric", std::string(kPhotometric)},
                                  {"measured", std::string(kMeasured)}},
                                 "Kind of maps; measured: geometric without the inferred pixels");
  parser->Add("bbox_path", &bbox_path, "File with the two corners of the box to fuse, world coordinates");
  parser->Add("StereoFusion.mask_path", &fusion.input.mask_path,
              "Folder of <image name>.png; 0 leaves a pixel out");
  parser->Add("StereoFusion.num_threads", &fusion.num_threads, "Threads; -1: all");
  parser
      ->Add("StereoFusion.max_image_size", &workspace.max_image_size,
            "Work on smaller maps: longest side; -1 = full size")
      .Unit("pixels");
  parser->Add("StereoFusion.min_num_pixels", &fusion.rule.min_num_views, "Images that must agree on a point")
      .ColmapDefault("5");
  parser
      ->Add("StereoFusion.max_num_pixels", &fusion.rule.max_num_views,
            "Most measurements merged into a point")
      .ColmapDefault("10000");
  parser
      ->Add("StereoFusion.max_reproj_error", &fusion.rule.max_reproj_error,
            "Largest distance in the other image between the points at both depths")
      .Unit("pixels")
      .ColmapDefault("2");
  parser
      ->Add("StereoFusion.max_depth_error", &fusion.rule.max_depth_error,
            "Largest difference of two depths, relative to depth")
      .ColmapDefault("0.0099999997764825821");
  parser->Add("StereoFusion.max_normal_error", &fusion.rule.max_normal_error, "Largest angle between normals")
      .Unit("degrees")
      .ColmapDefault("10");
  parser
      ->Add("StereoFusion.check_num_images", &fusion.max_neighbors,
            "Images that each image is compared with; -1 = all")
      .ColmapDefault("50");
  parser->AddColmapOnly("StereoFusion.max_traversal_depth", "100", "points are not found by traversal");
  parser->AddColmapOnly("StereoFusion.use_cache", "0",
                        "maps are always cached, within --PhiFusion.max_memory_gb");
  parser->AddColmapOnly("StereoFusion.cache_size", "32", "--PhiFusion.max_memory_gb bounds the memory");
  parser->AddChoice<phi::Formulas>("PhiFusion.formulas", &fusion.rule.formulas,
                                   {{"robust", phi::Formulas::kRobust}, {"paper", phi::Formulas::kPaper}},
                                   "paper = the paper's fusion; --preset paper sets this and its values");
  parser
      ->Add(
          "PhiFusion.max_normal_error_in_holes", &fusion.rule.max_normal_error_in_holes,
          "Largest angle between normals in holes of the cloud, if larger than StereoFusion.max_normal_error")
      .Unit("degrees");
  parser->Add("PhiFusion.min_support", &fusion.rule.min_support,
              "Least sum of the other images' agreements, each between 0 and 1");
  parser->Add("PhiFusion.min_support_inferred", &fusion.rule.min_support_inferred,
              "The same for pixels whose depth was inferred, if larger than min_support");
  parser->Add("PhiFusion.max_conflicts", &fusion.rule.max_conflicts,
              "Most images that see through a point, for each that supports it");
  parser->Add("PhiFusion.max_memory_gb", &fusion.max_memory_gb, "Memory for maps; 0: half of the computer's")
      .Unit("GB");
  // Every value that the paper names or that stands for its "all".
  parser->AddPreset("paper", {{"PhiFusion.formulas", "paper"},
                              {"StereoFusion.min_num_pixels", "1"},
                              {"StereoFusion.max_num_pixels", "10000"},
                              {"StereoFusion.max_depth_error", "0.01"},
                              {"StereoFusion.check_num_images", "-1"}});
}

void FusionCommandOptions::Finish(const OptionParser& parser) {
  workspace.path = FindWorkspaceFolder(workspace.path);
  CheckNumThreads("StereoFusion.num_threads", fusion.num_threads);
  CheckMaxImageSize("StereoFusion.max_image_size", workspace.max_image_size);
  std::string problem = fusion.rule.Check();
  const bool is_number = fusion.max_neighbors >= 1 && fusion.max_neighbors <= phi::kMaxFusionNeighbors / 2;
  if (problem.empty() && fusion.max_neighbors != -1 && !is_number) {
    problem = "--StereoFusion.check_num_images is " + std::to_string(fusion.max_neighbors) +
              ", but must be -1 (all) or between 1 and " + std::to_string(phi::kMaxFusionNeighbors / 2);
  }
  if (fusion.rule.formulas == phi::Formulas::kPaper) {
    parser.WarnWithoutEffect({"StereoFusion.max_reproj_error", "StereoFusion.max_normal_error",
                              "PhiFusion.max_normal_error_in_holes", "PhiFusion.min_support",
                              "PhiFusion.min_support_inferred", "PhiFusion.max_conflicts"},
                             "with --PhiFusion.formulas paper points agree by their distance alone");
  }
  if (problem.empty() && !(fusion.max_memory_gb >= 0))
    problem = "--PhiFusion.max_memory_gb must not be negative";
  if (!problem.empty()) throw phi::UsageError(problem);
  if (!bbox_path.empty()) fusion.box = ReadBoundingBox(bbox_path);
  fusion.input.downsize = workspace.max_image_size > 0;
}

}  // namespace colmap_ext

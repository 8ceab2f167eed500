// phimvs report: one HTML page about a workspace.
#include "colmap_ext/report/report.h"

#include <filesystem>
#include <sstream>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/cli/steps.h"
#include "colmap_ext/workspace_folder.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {

int RunReport(int argc, char** argv) {
  ReportOptions o;
  std::string evaluations;
  OptionParser parser("report", "One self-contained HTML page about a workspace");
  parser
      .Add("workspace_path", &o.workspace, "Folder that colmap image_undistorter wrote, or the one above it")
      .Required();
  parser.Add("output_path", &o.output, "The page (.html)").Required();
  parser.Add("cloud_path", &o.cloud, "Cloud to show; default: fused.ply of the workspace, where it exists");
  parser.Add("evaluation_path", &evaluations,
             "Scores that phimvs evaluate wrote; several separated by commas");
  parser.Add("truth_depth_maps", &o.truth_depth_maps, "True depths to compare with, as for phimvs evaluate");
  parser.Add("truth_depth_scale", &o.values_per_unit, "Value of one world unit in 16-bit .png depths");
  parser.Add("compare_workspace_path", &o.compare_workspace,
             "Workspace with another program's geometric maps");
  parser.Add("compare_name", &o.compare_name, "That program's name");
  parser.Add("picture_size", &o.picture_size, "Longest side of the pictures").Unit("pixels");
  parser.Add("max_images", &o.max_images,
             "Images with pictures, evenly over the workspace; figures are for all, those of the others from at most 256 rows of a map");
  parser.Add("max_points", &o.max_points, "Points of the cloud to show");
  if (!parser.Parse(argc, argv)) return 0;
  o.workspace = FindWorkspaceFolder(o.workspace);
  if (!o.compare_workspace.empty()) {
    o.compare_workspace = FindWorkspaceFolder(o.compare_workspace);
    if (!std::filesystem::is_directory(o.compare_workspace / "stereo")) {
      throw phi::InputError("--compare_workspace_path: " + phi::AboutFile(o.compare_workspace) +
                            " holds no stereo folder; name the workspace of the other program's maps");
    }
  }
  o.default_options = DefaultOptions();
  std::istringstream paths(evaluations);
  for (std::string path; std::getline(paths, path, ',');) o.evaluations.emplace_back(path);
  if (const std::string error = o.Check(); !error.empty()) throw phi::UsageError(phi::AboutStage("report") + ": " + error);
  WriteReport(o);
  phi::LogInfo("wrote " + o.output.string());
  return 0;
}

}  // namespace colmap_ext

// One self-contained HTML page about a workspace: what went in, what came out, how good and how long. It opens from
// disk and needs no network.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace colmap_ext {

struct ReportOptions {
  std::filesystem::path workspace;  // --workspace_path
  std::filesystem::path output;     // --output_path
  std::filesystem::path cloud;      // --cloud_path; empty: fused.ply of the workspace where it exists
  // What holds the points where that is not one PLY: the page names it, and tells of `cloud` only its fusion. Empty: they are shown.
  std::filesystem::path cloud_not_shown = {};
  std::vector<std::filesystem::path> evaluations;  // --evaluation_path: files that `phimvs evaluate` wrote
  std::filesystem::path truth_depth_maps;          // --truth_depth_maps; empty: none
  double values_per_unit = 1000;                   // --truth_depth_scale, of 16-bit PNG truth
  std::filesystem::path compare_workspace;  // --compare_workspace_path: geometric maps of another program
  std::string compare_name = "COLMAP";      // --compare_name
  int picture_size = 800;                   // --picture_size: longest side, pixels
  int max_images = 40;                      // --max_images with pictures; figures are for all
  int max_points = 250000;                  // --max_points of the cloud's view
  // To tell which of a run's options were chosen; options that are not named here are not told.
  std::map<std::string, std::string> default_options;
  std::string Check() const;
};

// Throws phi::UsageError for a file that is there and no report.
void CheckReportPlace(const std::filesystem::path& output);

void WriteReport(const ReportOptions& options);

}  // namespace colmap_ext

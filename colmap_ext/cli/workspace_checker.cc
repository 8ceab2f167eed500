// phimvs workspace_checker: lists every problem of a workspace at once. Exit code 2 when one of them is an error.
#include <filesystem>
#include <iostream>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/workspace_check.h"
#include "colmap_ext/workspace_folder.h"
#include "phi/base/error.h"

namespace colmap_ext {

int RunWorkspaceChecker(int argc, char** argv) {
  WorkspaceOptions options;
  std::filesystem::path config_path, fusion_mask_path;
  OptionParser parser("workspace_checker", "List every problem of an undistorted COLMAP workspace");
  parser.Append(options.FolderList());
  parser.Add("config_path", &config_path, "List of reference images; empty: stereo/patch-match.cfg");
  parser.Add("PhiStereo.mask_path", &options.mask_path, "Folder of masks named <image name>.png, to check them too");
  parser.Add("StereoFusion.mask_path", &fusion_mask_path, "The same of the masks of fusion alone");
  parser
      .Add("PatchMatchStereo.max_image_size", &options.max_image_size,
           "Longest side of the working resolution, as of the stereo: poses and disk space are judged for it; -1: full size")
      .Unit("pixels")
      .AtLeast(-1);
  if (!parser.Parse(argc, argv)) return static_cast<int>(phi::ExitCode::kOk);
  options.path = FindWorkspaceFolder(options.path);

  const WorkspaceReport report = CheckWorkspace(options, config_path, fusion_mask_path);
  for (const std::string& error : report.errors) std::cout << "error: " << error << "\n";
  for (const std::string& warning : report.warnings) std::cout << "warning: " << warning << "\n";
  std::cout << options.path.string() << ": " << report.num_images << " images, "
            << report.num_reference_images << " to estimate, " << report.num_points << " sparse points; "
            << report.errors.size() << " errors, " << report.warnings.size() << " warnings" << std::endl;
  return static_cast<int>(report.errors.empty() ? phi::ExitCode::kOk : phi::ExitCode::kBadInput);
}

}  // namespace colmap_ext

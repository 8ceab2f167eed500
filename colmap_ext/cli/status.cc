// phimvs status: how far the stereo of a workspace is, whoever works on it.
#include <iostream>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/pipeline/run_status.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "colmap_ext/workspace_folder.h"
#include "phi/base/error.h"

namespace colmap_ext {

int RunStatusCommand(int argc, char** argv) {
  std::filesystem::path path;
  OptionParser parser("status",
                      "How far the stereo of a workspace is: images done, failed and waiting by stage");
  parser.Add("workspace_path", &path, "The undistorted workspace").Required();
  if (!parser.Parse(argc, argv)) return static_cast<int>(phi::ExitCode::kOk);
  path = FindWorkspaceFolder(path);
  const std::filesystem::path stereo = path / "stereo";
  if (!std::filesystem::is_directory(stereo)) {
    throw phi::InputError("--workspace_path: " + phi::AboutFile(path) + " holds no stereo folder; name the workspace of the run");
  }
  const LockUse use = FindLockUse(stereo);  // first: a run that ends meanwhile would be missed as killed
  const RunRecord record(stereo);
  const RunStatus status = FindStatus(record);
  if (status.num_images == 0 && use != LockUse::kHeld) {  // a run that has just begun is no mistake
    if (!record.HasRuns()) throw phi::InputError(phi::AboutFile(stereo) + ": phimvs patch_match_stereo has not run here yet");
    std::cout << "no maps by phimvs: dense --keep cloud removed them, or hole_filler --restore put the earlier ones back\n";
    return static_cast<int>(phi::ExitCode::kOk);
  }
  std::cout << StatusText(status, use);
  return static_cast<int>(phi::ExitCode::kOk);
}

}  // namespace colmap_ext

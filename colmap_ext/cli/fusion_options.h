// The options of stereo_fusion: COLMAP's names and ours, for every command that fuses.
#pragma once

#include <filesystem>

#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

struct FusionCommandOptions {
  WorkspaceOptions workspace;
  std::filesystem::path bbox_path;
  SceneFusionOptions fusion;

  // Adds --workspace_path and its kin, then RegisterFusion.
  void Register(OptionParser* parser);
  // Adds --input_type, --bbox_path, --StereoFusion.* and --PhiFusion.* only.
  void RegisterFusion(OptionParser* parser);
  // After Parse: derives what depends on several options, and checks all. Throws phi::UsageError.
  void Finish(const OptionParser& parser);
};

}  // namespace colmap_ext

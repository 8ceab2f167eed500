// The options of patch_match_stereo: COLMAP's names and ours, for every command that runs the stereo.
#pragma once

#include <filesystem>
#include <string>

#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/pipeline/backend_choice.h"
#include "colmap_ext/pipeline/pipeline_options.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

struct StereoCommandOptions {
  WorkspaceOptions workspace;
  std::filesystem::path config_path;  // empty: stereo/patch-match.cfg of the workspace
  BackendOptions backend;
  PipelineOptions pipeline;

  // Adds --PatchMatchStereo.*, --PhiStereo.*, --PhiInference.* and --overwrite.
  void Register(OptionParser* parser);
  // Only what matters where maps are there already.
  void RegisterFilling(OptionParser* parser);
  // After Parse: derives what depends on several options, and checks all. Throws phi::UsageError.
  void Finish(const OptionParser& parser);

 private:
  // Workspace, list of images and devices.
  void RegisterInput(OptionParser* parser);
  void RegisterColmapOnly(OptionParser* parser);
  void RegisterPreset(OptionParser* parser);
  void ApplyFormulas(const OptionParser& parser);
};

}  // namespace colmap_ext

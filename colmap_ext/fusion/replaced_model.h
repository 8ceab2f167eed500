// The sparse model that a cloud of BIN or TXT takes the place of.
#pragma once

#include "colmap_ext/fusion/cloud_output.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Throws phi::UsageError where the folder holds a model in the output's form that is no earlier cloud: its points and tracks, and COLMAP's
// rigs and frames, would be lost.
void RequireReplaceableModel(const Workspace& workspace, const CloudOutput& output);

}  // namespace colmap_ext

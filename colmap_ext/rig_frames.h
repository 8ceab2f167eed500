// rigs.* and frames.* of a sparse model: COLMAP 3.12 and later take the images' poses from there, and not from images.*. Programs
// that do not know them leave them as they were.
#pragma once

#include <filesystem>
#include <string>

#include "colmap_ext/sparse_model.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// What is to be said of frames that tell other poses than `model`, which was read from this folder; empty where they tell the same,
// and where there are none.
std::string FramesWarning(const std::filesystem::path& folder, const SparseModel& model);
void WarnOfFrames(const Workspace& workspace);

}  // namespace colmap_ext

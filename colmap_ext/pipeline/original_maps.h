// Another program's maps whose holes were filled. The originals stay: as <image>.measured.bin, from which every filling
// starts, and where that had to differ from them also as <image>.original.bin.
#pragma once

#include <vector>

#include "colmap_ext/pipeline/stage_plan.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Makes the measured maps of an image from its geometric ones, which stay untouched; the same after a second call.
void KeepOriginalMaps(const Workspace& workspace, int image);

// Puts the geometric maps that hole_filler replaced back as they were and removes what it made of them. Maps that
// patch_match_stereo made are left alone. Returns the number of images. Throws phi::InputError where there are none.
int RestoreOriginalMaps(const Workspace& workspace, const std::vector<ImageJob>& jobs);

}  // namespace colmap_ext

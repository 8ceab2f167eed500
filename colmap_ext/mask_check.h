// What is wrong with the masks of --PhiStereo.mask_path.
#pragma once

#include <string>
#include <vector>

#include "colmap_ext/problem_list.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Empty where there is no folder of masks, or each of the images has one; else how many have none, in a sentence.
std::string DescribeMissingMasks(const Workspace& workspace, const std::vector<int>& images);

// Reads all masks. Errors: those that fail their image. Warnings: images without one, files that are no image's.
void CheckMasks(const Workspace& workspace, ProblemList* errors, ProblemList* warnings);

}  // namespace colmap_ext

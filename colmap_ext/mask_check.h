// What is wrong with the masks of --PhiStereo.mask_path and --StereoFusion.mask_path.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/problem_list.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Empty where there is no folder of masks, or each of the images has one; else how many have none, in a sentence.
std::string DescribeMissingMasks(const Workspace& workspace, const std::filesystem::path& folder, const std::vector<int>& images);
// Likewise of masks with an alpha channel, by their headers: photos that were cut out have the mask there, where nothing reads it.
std::string DescribeTransparentMasks(const Workspace& workspace, const std::filesystem::path& folder, const std::vector<int>& images);

// Read all masks. Errors: those that fail their image. Warnings: images without one, files that are no image's, masks that leave a whole image out; in fusion, which takes
// masks of any size, those of another shape than their image.
void CheckMasks(const Workspace& workspace, ProblemList* errors, ProblemList* warnings);
void CheckFusionMasks(const Workspace& workspace, const std::filesystem::path& folder, ProblemList* errors, ProblemList* warnings);

}  // namespace colmap_ext

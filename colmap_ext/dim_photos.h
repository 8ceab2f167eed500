// Photos of 16 bits that hold values of 10, 12 or 14: of the 8 bits that matching takes hardly a grey level would be left.
#pragma once

#include <string>
#include <vector>

#include "colmap_ext/workspace.h"

namespace colmap_ext {

// What is to be said of such photos among these images (indices into Workspace::views()); empty where there are none. Photos that
// cannot be read are left out.
std::string DescribeDimPhotos(const Workspace& workspace, const std::vector<int>& images);

// Of the first, the middle and the last image: photos of one camera are alike, and to decode all takes long.
std::string DescribeDimPhotosOfSome(const Workspace& workspace);

}  // namespace colmap_ext

// Whether maps are in the unit of the sparse model: another program's may be in millimetres where the model is in metres, and
// who scales a model later leaves the maps as they were. Nothing agrees then, in silence.
#pragma once

#include <string_view>
#include <vector>

#include "colmap_ext/workspace.h"
#include "phi/base/message.h"

namespace colmap_ext {

// What is to be said of maps whose depths are not those of the sparse points there; empty where they are, or too few points tell.
// Of each image, the first of `kinds` that it has counts. Looks at a few images, and reads of each a few rows. Never throws: what
// cannot be read is told where it is used.
phi::Message MapScaleWarning(const Workspace& workspace, const std::vector<std::string_view>& kinds);

// Says it.
void WarnOfMapScale(const Workspace& workspace, const std::vector<std::string_view>& kinds);

}  // namespace colmap_ext

// Photos that were renamed or moved after the sparse model was made: one sentence in place of one for each image.
#pragma once

#include "colmap_ext/workspace.h"
#include "phi/base/message.h"

namespace colmap_ext {

// Empty where a single one of the model's images is there. Else what is under images/ in their place, and what to do.
phi::Message DescribeMissingImages(const Workspace& workspace);

// Throws phi::InputError with that sentence.
void RequireAnImage(const Workspace& workspace);

}  // namespace colmap_ext

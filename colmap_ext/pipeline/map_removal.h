// Takes the maps of a finished run away again.
#pragma once

#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Removes the files of all results that phimvs.json knows, where they are still those; other programs' maps stay. The next run
// makes all maps again. Throws phi::InputError when another process works in the workspace.
void RemoveRecordedMaps(const Workspace& workspace);

}  // namespace colmap_ext

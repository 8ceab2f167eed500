// Maps that lie in a workspace and are not what its last run would have made.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "colmap_ext/workspace.h"

namespace colmap_ext {

// One sentence for each kind of such maps among those of `kind`, with what to do. Empty where the last run made them all,
// and where phimvs never ran, so that all are another program's. A damaged phimvs.json is a sentence, too: maps can be fused
// without it.
std::vector<std::string> DescribeStaleMaps(const Workspace& workspace, std::string_view kind);

}  // namespace colmap_ext

// What a user who misspelt a name may have meant.
#pragma once

#include <string>
#include <vector>

namespace colmap_ext {

// " (did you mean --Group.name?)" with the name that differs in the fewest letters, or "" when none is near. A name may be
// found by its last part alone: max_image_size finds PatchMatchStereo.max_image_size. `prefix` goes before the name.
std::string SuggestName(const std::string& word, const std::vector<std::string>& names,
                        const std::string& prefix = "");

}  // namespace colmap_ext

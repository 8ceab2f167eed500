// A part of the images, for one of several processes that work on a workspace at the same time or one after the other.
#pragma once

#include <string>
#include <utility>

#include "phi/base/error.h"

namespace colmap_ext {

// The process exit code of a shard that needs what others have not made yet; beside those of phi, which knows no shards.
inline constexpr phi::ExitCode kRetryLater{6};

struct Shard {
  int index = 0, count = 1;  // 0 <= index < count
  std::string only_stage;    // the kind of result that is made; empty: all

  bool IsWhole() const { return count == 1 && only_stage.empty(); }
  // [begin, end) of `num_items` in their order: neighbours in the list are often neighbours in the scene.
  std::pair<int, int> Range(int num_items) const;
  std::string Name() const;  // "3/8"
};

}  // namespace colmap_ext

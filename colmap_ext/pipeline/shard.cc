#include "colmap_ext/pipeline/shard.h"

#include <cstdint>

namespace colmap_ext {

std::pair<int, int> Shard::Range(int num_items) const {
  const auto begin_of = [&](std::int64_t k) { return static_cast<int>(k * num_items / count); };
  return {begin_of(index), begin_of(index + 1)};
}

std::string Shard::Name() const { return std::to_string(index) + "/" + std::to_string(count); }

}  // namespace colmap_ext

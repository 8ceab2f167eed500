// How near each point of one cloud is to another cloud, in classes of tolerance.
#pragma once

#include <cstddef>
#include <vector>

#include "colmap_ext/evaluation/tolerance_class.h"
#include "phi/base/vec.h"

namespace colmap_ext {

// For every query: the first tolerance (world units, ascending) not below the distance to its nearest
// reference point; the number of tolerances when there is none. `working_memory`: bytes for search trees,
// over all threads.
std::vector<ToleranceClass> ClassifyByNearest(const std::vector<phi::Vec3f>& queries,
                                              const std::vector<phi::Vec3f>& references,
                                              const std::vector<double>& tolerances,
                                              std::size_t working_memory);

}  // namespace colmap_ext

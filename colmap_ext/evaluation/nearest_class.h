// How near each point of one cloud is to another cloud, in classes of tolerance.
#pragma once

#include <cstddef>
#include <vector>

#include "colmap_ext/evaluation/tolerance_class.h"
#include "phi/base/vec.h"

namespace colmap_ext {

// Lowers each query's class to the first tolerance (world units, ascending) that is not below the distance to its nearest reference
// point, where there is one. Classes begin with the number of tolerances, or with what other references gave; those with kNotCounted
// stay. Both clouds in the order of one curve (curve_order.h), or this takes long. `working_memory`: bytes for search trees.
void LowerToNearest(const std::vector<phi::Vec3f>& queries, const std::vector<phi::Vec3f>& references,
                    const std::vector<double>& tolerances, std::size_t working_memory,
                    std::vector<ToleranceClass>& classes);

}  // namespace colmap_ext

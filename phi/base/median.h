// The median of a list.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace phi {

// The upper one of an even number. Reorders the values, of which there is at least one.
template <typename T>
T Median(std::vector<T>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

}  // namespace phi

// The devices of a list that work.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "phi/backend.h"

namespace phi {

// One backend for each index, however often the list names it, in its order. A device that `make` throws phi::DeviceError
// for is left out with a warning; the first such error is thrown when none is left. Other errors pass.
std::vector<std::unique_ptr<Backend>> MakeWorkingBackends(
    const std::vector<int>& indices, const std::function<std::unique_ptr<Backend>(int index)>& make);

}  // namespace phi

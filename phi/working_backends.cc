#include "phi/working_backends.h"

#include <exception>
#include <set>
#include <string>

#include "phi/base/device_error.h"
#include "phi/base/log.h"

namespace phi {

std::vector<std::unique_ptr<Backend>> MakeWorkingBackends(
    const std::vector<int>& indices, const std::function<std::unique_ptr<Backend>(int index)>& make) {
  std::vector<std::unique_ptr<Backend>> backends;
  std::set<int> seen;
  std::exception_ptr first_error;
  for (const int index : indices) {
    if (!seen.insert(index).second) continue;  // twice the same would count its memory twice
    try {
      backends.push_back(make(index));
    } catch (const DeviceError& error) {
      if (!first_error) first_error = std::current_exception();
      LogWarning("GPU " + std::to_string(index) + " is left out: " + error.what());
    }
  }
  if (backends.empty() && first_error) std::rethrow_exception(first_error);
  return backends;
}

}  // namespace phi

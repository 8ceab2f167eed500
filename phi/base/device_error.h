// A device that cannot do what it was given: a fault of a kernel, a lost device, memory that other programs took. Another
// device may.
#pragma once

#include "phi/base/error.h"

namespace phi {

struct DeviceError : ResourceError {
  using ResourceError::ResourceError;
};

}  // namespace phi

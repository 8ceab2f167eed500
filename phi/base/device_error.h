// A device that cannot do what it was given: a fault of a kernel, a lost device, memory that other programs took. Another
// device may.
#pragma once

#include "phi/base/error.h"

namespace phi {

struct DeviceError : ResourceError {
  using ResourceError::ResourceError;
};

// Work that does not fit a device's memory even in its smallest parts. The device is well, and may do other work.
struct TooLargeForDevice : DeviceError {
  using DeviceError::DeviceError;
};

}  // namespace phi

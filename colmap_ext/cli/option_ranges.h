// The rules of options that several commands have.
#pragma once

#include <string>

#include "phi/base/error.h"

namespace colmap_ext {

// Throws phi::UsageError. -1 and 0: all processors.
inline void CheckNumThreads(const std::string& option, int num_threads) {
  constexpr int kMost = 1024;
  if (num_threads >= -1 && num_threads <= kMost) return;
  throw phi::UsageError("--" + option + " is " + std::to_string(num_threads) +
                        ", but must be -1 for all processors or from 1 to " + std::to_string(kMost));
}

// Throws phi::UsageError. -1 and 0: full size.
inline void CheckMaxImageSize(const std::string& option, int pixels) {
  if (pixels >= -1) return;
  throw phi::UsageError("--" + option + " is " + std::to_string(pixels) +
                        ", but must be -1 for the full size or a number of pixels");
}

}  // namespace colmap_ext

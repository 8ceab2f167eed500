#include "phi/texture_limits.h"

#include <algorithm>
#include <string>

#include "phi/base/error.h"

namespace phi {

void RequireTextureSize(int width, int height, const TextureLimits& limits, const Message& task) {
  if (width <= limits.max_width && height <= limits.max_height) return;
  const auto size = [](int w, int h) { return std::to_string(w) + "x" + std::to_string(h); };
  throw InputError(
      task + ": an image of " + size(width, height) + " pixels is larger than this GPU's textures (" +
      size(limits.max_width, limits.max_height) + "); lower --PatchMatchStereo.max_image_size to " +
      std::to_string(std::min(limits.max_width, limits.max_height)) + " or run with --PhiStereo.backend cpu");
}

}  // namespace phi

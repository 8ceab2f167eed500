// The largest image that a GPU reads as a texture.
#pragma once

#include "phi/base/message.h"

namespace phi {

// Of a device, in pixels.
struct TextureLimits {
  int max_width = 0, max_height = 0;
};

// Throws phi::InputError, which leaves out this image alone, where an image of width x height pixels is larger.
// `task`: what it was needed for, named first in the message.
void RequireTextureSize(int width, int height, const TextureLimits& limits, const Message& task);

}  // namespace phi

// The card's ceiling for the matching cost: how many bilinear samples a second its texture units filter at best.
#pragma once

namespace phi::gpu {

// Samples/s of a plain kernel that does little beside fetching neighbouring pixels of an 8-bit texture; measured in some
// milliseconds on the current device, whose clocks it first brings up.
double MeasureFetchRate();

}  // namespace phi::gpu

#pragma once

#include <string>

namespace phi {

// The time of day, UTC, ISO 8601 to the second.
std::string UtcNow();

}  // namespace phi

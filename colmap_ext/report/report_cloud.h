// The thinned cloud that the report shows.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace colmap_ext {

// Coordinates are 16-bit, x = center + scale * value / 32767.
struct ReportCloud {
  std::size_t num_points = 0;  // of the file
  std::size_t num_shown = 0;
  double center[3] = {0, 0, 0};
  double scale = 1;
  std::string positions;  // base64 of little-endian int16, x y z
  std::string colors;     // base64 of uint8, r g b
};

// Takes points evenly over the file; drops what lies far outside the bulk, so that a few strays do not shrink the view.
ReportCloud MakeReportCloud(const std::filesystem::path& ply, int max_points);

}  // namespace colmap_ext

// The report's part on images: figures for all of them, pictures for some.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "colmap_ext/report/report.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// A colour scale: its palette ("turbo", "inferno", "viridis") and what its ends mean; no palette: none.
struct ReportLegend {
  std::string palette, from, to;
};

struct ReportPicture {
  std::string title, uri, caption;
  ReportLegend legend;
};

// Shares are percent of the map's pixels; negative: there is no such map.
struct ReportImage {
  std::string name;
  int view = 0;                         // index into the workspace's views
  int width = 0, height = 0;            // of the final map, pixels; 0: there is none
  double photometric = -1;              // raw estimate
  double measured = -1;                 // confirmed by other views
  double geometric = -1;                // what fusers read: measured and filled
  double filled = -1;                   // inferred pixels among these
  // Of the final map: 2nd, 50th and 98th percentile of depth, world units, and the size of a pixel at the median depth.
  double near_depth = 0, median_depth = 0, far_depth = 0, pixel_size = 0;
  std::map<int, std::int64_t> depth_histogram;  // pixels by the eighth of an octave of depth: floor(8 log2(depth))
  std::vector<ReportPicture> pictures;  // empty beyond --max_images
  std::vector<std::string> warnings;
};

std::vector<ReportImage> MakeReportImages(const Workspace& workspace, const ReportOptions& options);

}  // namespace colmap_ext

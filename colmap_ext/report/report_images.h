// The report's part on images: figures for all of them, pictures for some.
#pragma once

#include <string>
#include <vector>

#include "colmap_ext/report/report.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

struct ReportPicture {
  std::string title, uri, caption;
};

// Shares are percent of the map's pixels; negative: there is no such map.
struct ReportImage {
  std::string name;
  double photometric = -1;              // raw estimate
  double measured = -1;                 // confirmed by other views
  double geometric = -1;                // what fusers read: measured and filled
  double filled = -1;                   // inferred pixels among these
  std::vector<ReportPicture> pictures;  // empty beyond --max_images
  std::vector<std::string> warnings;
};

std::vector<ReportImage> MakeReportImages(const Workspace& workspace, const ReportOptions& options);

}  // namespace colmap_ext

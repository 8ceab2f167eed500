// The report's HTML page: page.html with page.css, page.js and cloud_view.js put in, all from this folder.
#pragma once

#include <string>

namespace colmap_ext {

// `data`: JSON that is safe inside a script element.
std::string ReportPage(const std::string& data);

}  // namespace colmap_ext

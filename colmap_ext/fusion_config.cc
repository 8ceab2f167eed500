#include "colmap_ext/fusion_config.h"

#include <algorithm>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/config_lines.h"

namespace colmap_ext {

namespace fs = std::filesystem;

std::vector<int> ReadFusionConfig(const Workspace& workspace, const fs::path& config_path,
                                  ProblemList* problems) {
  const fs::path path = config_path.empty() ? workspace.StereoFolder() / "fusion.cfg" : config_path;
  std::vector<int> images;
  for (const ConfigLine& line : ReadConfigLines(path)) {
    const int image = workspace.FindImage(line.text);
    if (image < 0) {
      ReportProblem(problems, LineText(path, line.number) + "image '" + line.text +
                                  "' is not in the sparse model; correct the name or take it out");
    } else if (std::find(images.begin(), images.end(), image) != images.end()) {
      ReportProblem(problems,
                    LineText(path, line.number) + "image '" + line.text + "' is named twice; take one out");
    } else {
      images.push_back(image);
    }
  }
  if (images.empty()) ReportProblem(problems, phi::AboutFile(path) + ": names no image of the sparse model");
  return images;
}

void WriteFusionConfig(const fs::path& path, const std::vector<std::string>& image_names) {
  AtomicFile file(path);
  for (const std::string& name : image_names) file.Write(name + "\n");
  file.Commit();
}

}  // namespace colmap_ext

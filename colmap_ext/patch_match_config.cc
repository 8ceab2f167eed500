#include "colmap_ext/patch_match_config.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <string_view>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/config_lines.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kAll = "__all__";
constexpr std::string_view kAutomatic = "__auto__";

// COLMAP takes the semicolon as a separator too. Empty fields (a comma at the end) are dropped.
std::vector<std::string_view> SplitFields(std::string_view line) {
  std::vector<std::string_view> fields;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find_first_of(",;"), line.size());
    const std::string_view field = Trim(line.substr(0, end));
    if (!field.empty()) fields.push_back(field);
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return fields;
}

class PatchMatchConfigReader {
 public:
  PatchMatchConfigReader(const Workspace& workspace, const fs::path& path, ProblemList* problems)
      : workspace_(workspace), path_(path), problems_(problems) {}

  std::vector<PatchMatchProblem> Read() {
    const std::vector<ConfigLine> lines = ReadConfigLines(path_);
    std::vector<PatchMatchProblem> result;
    for (std::size_t i = 0; i < lines.size(); i += 2) {
      PatchMatchProblem problem;
      if (!ReadReference(lines[i], &problem)) continue;
      if (i + 1 == lines.size()) {
        Report(lines[i], "no line of source images follows reference image '" + lines[i].text +
                             "'; add one, for example __auto__, 20");
      } else if (ReadSources(lines[i + 1], &problem)) {
        result.push_back(std::move(problem));
      }
    }
    if (lines.empty()) ReportProblem(problems_, phi::AboutFile(path_) + ": names no reference image");
    return result;
  }

 private:
  void Report(const ConfigLine& line, const std::string& message) {
    ReportProblem(problems_, LineText(path_, line.number) + message);
  }

  // The image's index, or -1 after reporting.
  int FindImage(const ConfigLine& line, std::string_view name, const char* role) {
    const int image = workspace_.FindImage(name);
    if (image < 0) {
      Report(line, std::string(role) + " image '" + std::string(name) +
                       "' is not in the sparse model; correct the name or take it out");
    }
    return image;
  }

  bool ReadReference(const ConfigLine& line, PatchMatchProblem* problem) {
    if (line.text == kAll || line.text.starts_with(kAutomatic)) {
      Report(line, "the name of a reference image is expected, not '" + line.text +
                       "'; lines come in pairs, the reference image first");
      return false;
    }
    problem->reference = FindImage(line, line.text, "reference");
    if (problem->reference < 0) return false;
    const auto [first, is_new] = line_of_reference_.emplace(problem->reference, line.number);
    if (!is_new) {
      Report(line, "reference image '" + line.text + "' is already on line " + std::to_string(first->second) +
                       "; take one of them out");
    }
    return is_new;
  }

  bool ReadSources(const ConfigLine& line, PatchMatchProblem* problem) {
    const std::vector<std::string_view> fields = SplitFields(line.text);
    if (fields.size() == 1 && fields[0] == kAll) {
      for (int image = 0; image < static_cast<int>(workspace_.views().size()); ++image) {
        if (image != problem->reference) problem->sources.push_back(image);
      }
      return true;
    }
    if (!fields.empty() && fields[0] == kAutomatic) return ReadAutomatic(line, fields, problem);
    if (fields.empty()) Report(line, "'" + line.text + "' names no source image");
    for (const std::string_view field : fields) AddSource(line, field, problem);
    return !problem->sources.empty();
  }

  bool ReadAutomatic(const ConfigLine& line, const std::vector<std::string_view>& fields,
                     PatchMatchProblem* problem) {
    int count = 0;
    if (fields.size() == 2) {
      const auto [end, error] = std::from_chars(fields[1].data(), fields[1].data() + fields[1].size(), count);
      if (error != std::errc() || end != fields[1].data() + fields[1].size()) count = 0;
    }
    if (count < 1) {
      Report(line, "'" + line.text + "' must be __auto__, N with N at least 1");
      return false;
    }
    problem->max_automatic_sources = count;
    return true;
  }

  void AddSource(const ConfigLine& line, std::string_view name, PatchMatchProblem* problem) {
    const int image = FindImage(line, name, "source");
    if (image < 0) return;
    if (image == problem->reference) {
      Report(line, "image '" + std::string(name) + "' is a source of itself; take it out");
    } else if (std::find(problem->sources.begin(), problem->sources.end(), image) != problem->sources.end()) {
      Report(line, "source image '" + std::string(name) + "' is named twice; take one out");
    } else {
      problem->sources.push_back(image);
    }
  }

  const Workspace& workspace_;
  fs::path path_;
  ProblemList* problems_;
  std::map<int, int> line_of_reference_;
};

}  // namespace

std::vector<PatchMatchProblem> ReadPatchMatchConfig(const Workspace& workspace, const fs::path& config_path,
                                                    ProblemList* problems) {
  const fs::path path = config_path.empty() ? workspace.StereoFolder() / "patch-match.cfg" : config_path;
  return PatchMatchConfigReader(workspace, path, problems).Read();
}

void WritePatchMatchConfig(const fs::path& path, const std::vector<std::string>& image_names,
                           int max_num_sources) {
  AtomicFile file(path);
  for (const std::string& name : image_names) {
    file.Write(name + "\n" + std::string(kAutomatic) + ", " + std::to_string(max_num_sources) + "\n");
  }
  file.Commit();
}

}  // namespace colmap_ext

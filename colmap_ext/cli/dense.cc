// phimvs dense: from an undistorted workspace to a cloud and a report, in one command.
#include <algorithm>
#include <string>
#include <vector>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/fusion_options.h"
#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/cli/stereo_options.h"
#include "colmap_ext/report/report.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// The command line of one step: those options of `all` that the user set and that `step` knows.
class StepCommand {
 public:
  StepCommand(const OptionParser& all, const OptionParser& step, const std::string& name) : words_{name} {
    const auto values = all.EffectiveValues();
    for (const auto& [option, unused] : step.EffectiveValues()) {
      if (option != "project_path" && all.IsSet(option)) Add(option, values.at(option));
    }
  }

  void Add(const std::string& option, const std::string& value) {
    words_.push_back("--" + option);
    words_.push_back(value);
  }

  int Run(CommandFunction command) {
    std::vector<char*> argv;
    for (std::string& word : words_) argv.push_back(word.data());
    return command(static_cast<int>(argv.size()), argv.data());
  }

 private:
  std::vector<std::string> words_;
};

// Of all images or of some.
bool IsDone(int code) {
  return code == static_cast<int>(phi::ExitCode::kOk) ||
         code == static_cast<int>(phi::ExitCode::kSomeImagesFailed);
}

}  // namespace

int RunDense(int argc, char** argv) {
  std::filesystem::path output, report_path;
  StereoCommandOptions stereo, stereo_defaults;
  FusionCommandOptions fusion, fusion_defaults;
  OptionParser parser("dense", "From an undistorted COLMAP workspace to a cloud and a report");
  parser.Add("output_path", &output, "The cloud (.ply); default: fused.ply in the workspace");
  parser.Add("report_path", &report_path, "The report (.html); default: report.html in the workspace");
  stereo.Register(&parser);
  fusion.RegisterFusion(&parser);
  if (!parser.Parse(argc, argv)) return 0;
  stereo.Finish(parser);
  fusion.workspace = stereo.workspace;
  fusion.Finish(parser);  // a mistake in fusion's options must not come out after hours of stereo

  OptionParser stereo_parser("patch_match_stereo", ""), fusion_parser("stereo_fusion", "");
  stereo_defaults.Register(&stereo_parser);
  fusion_defaults.RegisterFusion(&fusion_parser);
  const std::filesystem::path workspace = stereo.workspace.path;
  const std::string cloud = (output.empty() ? workspace / "fused.ply" : output).string();

  const int stereo_code = StepCommand(parser, stereo_parser, "patch_match_stereo").Run(RunPatchMatchStereo);
  if (!IsDone(stereo_code)) return stereo_code;
  StepCommand fuse(parser, fusion_parser, "stereo_fusion");
  fuse.Add("workspace_path", workspace.string());
  fuse.Add("output_path", cloud);
  const int fusion_code = fuse.Run(RunStereoFusion);
  if (!IsDone(fusion_code)) return fusion_code;

  ReportOptions report;
  report.workspace = workspace;
  report.cloud = cloud;
  report.output = report_path.empty() ? workspace / "report.html" : report_path;
  WriteReport(report);
  phi::LogInfo("cloud: " + cloud + ", report: " + report.output.string());
  return std::max(stereo_code, fusion_code);
}

}  // namespace colmap_ext

// phimvs dense: from an undistorted workspace to a cloud and a report, in one command.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/cli/steps.h"
#include "colmap_ext/fusion/tile_list.h"
#include "colmap_ext/pipeline/map_removal.h"
#include "colmap_ext/pipeline/stage_graph.h"
#include "colmap_ext/report/report.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// Of all images or of some.
bool IsDone(int code) {
  return code == static_cast<int>(phi::ExitCode::kOk) ||
         code == static_cast<int>(phi::ExitCode::kSomeImagesFailed);
}

// What remains of the maps once cloud and report are there.
enum class Keep {
  kCloud,  // nothing
  kMaps,   // COLMAP's geometric maps, and the others in compact files
  kAll,    // all in COLMAP's form
};

struct DenseCommandOptions {
  CloudOutput output;
  Keep keep = Keep::kAll;
  std::filesystem::path report_path;
  StereoCommandOptions stereo;
  FusionCommandOptions fusion;

  void Register(OptionParser* parser) {
    parser->Add("output_path", &output.path, "The cloud (.ply or .las); default: fused.ply in the workspace");
    parser->Append(output.List());
    parser->Add("report_path", &report_path, "The report (.html); default: report.html in the workspace");
    parser->AddChoice("keep", &keep, {{"cloud", Keep::kCloud}, {"maps", Keep::kMaps}, {"all", Keep::kAll}},
                      "What remains beside cloud and report: cloud = no maps; maps = COLMAP's geometric ones, and what phimvs "
                      "needs to go on in compact files; all = all in COLMAP's form");
    stereo.Register(parser);
    fusion.RegisterFusion(parser);
  }
};

// Maps of a kind that these options do not make would be another run's.
void FuseWhatIsMade(const OptionParser& parser, const PipelineOptions& stereo, std::string* kind) {
  const std::vector<Stage> stages = BuildStages(stereo);
  const auto makes_it = [&](const Stage& stage) { return stage.is_output && stage.result == *kind; };
  if (std::any_of(stages.begin(), stages.end(), makes_it)) return;
  const std::string made = stages.back().result;
  const std::string cause = stereo.geom_consistency ? "--PatchMatchStereo.filter" : "--PatchMatchStereo.geom_consistency";
  if (parser.IsSet("input_type")) {
    throw phi::UsageError("--input_type " + *kind + ": with " + cause + " false no " + *kind +
                          " maps are made; leave one of the two out, or fuse the " + made + " ones");
  }
  *kind = made;
  phi::LogInfo("the " + made + " maps are fused, since " + cause + " is false");
}

}  // namespace

std::map<std::string, std::string> DefaultOptions() {
  DenseCommandOptions options;
  OptionParser parser("dense", "");
  options.Register(&parser);
  std::map<std::string, std::string> values = parser.EffectiveValues();
  // Where files lie is no setting of a result.
  for (const char* place : {"workspace_path", "output_path", "report_path"}) values.erase(place);
  return values;
}

int RunDense(int argc, char** argv) {
  DenseCommandOptions options;
  OptionParser parser("dense", "From an undistorted COLMAP workspace to a cloud and a report");
  options.Register(&parser);
  if (!parser.Parse(argc, argv)) return 0;
  auto& [output, keep, report_path, stereo, fusion] = options;
  stereo.Finish(parser);
  stereo.pipeline.compact_maps |= keep != Keep::kAll;
  fusion.workspace.path = stereo.workspace.path;
  // Who keeps stereo off the GPU means all of the command.
  FusionBackend& fusion_backend = fusion.fusion.backend;
  if (stereo.backend.kind == BackendKind::kCpu && fusion_backend == FusionBackend::kAuto) fusion_backend = FusionBackend::kCpu;
  fusion.fusion.gpus = GpusOf(stereo.backend);
  FuseWhatIsMade(parser, stereo.pipeline, &fusion.fusion.input.kind);
  if (keep == Keep::kCloud && fusion.fusion.write_confidence_maps) {
    throw phi::UsageError("--PhiFusion.write_confidence_maps: --keep cloud leaves no maps; leave one of the two out, or --keep maps");
  }
  fusion.Finish(parser);  // a mistake in fusion's options must not come out after hours of stereo

  const std::filesystem::path workspace = stereo.workspace.path;
  ReportOptions report;
  report.workspace = workspace;
  report.default_options = DefaultOptions();
  if (output.path.empty()) output.path = workspace / "fused.ply";
  output.Resolve();
  if (!output.IsFile()) throw phi::UsageError("--output_type: dense writes PLY and LAS; stereo_fusion writes the others");
  report.cloud = output.path;
  if (output.tile_size > 0) {
    report.cloud_not_shown = TileListPath(output.path);
  } else if (output.type != CloudType::kPly) {
    report.cloud_not_shown = output.path;
  }
  report.output = report_path.empty() ? workspace / "report.html" : report_path;
  const auto place = [](const std::filesystem::path& path) { return std::filesystem::absolute(path).lexically_normal(); };
  if (place(report.output) == place(output.path))
    throw phi::UsageError("--report_path and --output_path are both " + phi::AboutFile(output.path) + "; give them two names");
  CheckReportPlace(report.output);

  // Tried before long work; not where there is no workspace, whose folder that would make.
  std::unique_ptr<CloudLock> lock;
  if (std::filesystem::is_directory(workspace)) {
    for (const auto& path : {output.path, report.output}) AtomicFile(path, Durability::kProcess);
    lock = std::make_unique<CloudLock>(output.path);
  }
  HandedMaps handed;
  const int stereo_code = EstimateMaps(stereo, parser.EffectiveValues(), {}, &handed);
  if (!IsDone(stereo_code)) return stereo_code;
  const int fusion_code = FuseMaps(fusion, output, std::move(handed), std::move(lock));
  if (!IsDone(fusion_code)) return fusion_code;
  WriteReport(report);
  phi::LogInfo("report: " + report.output.string());
  const int code = std::max(stereo_code, fusion_code);
  // Where images failed, the next run needs the maps of the others.
  if (keep == Keep::kCloud && code == static_cast<int>(phi::ExitCode::kOk)) RemoveRecordedMaps(Workspace(stereo.workspace));
  return code;
}

}  // namespace colmap_ext

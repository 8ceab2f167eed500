// phimvs stereo_fusion: fuses the maps of a workspace into a coloured point cloud. COLMAP's options and files.
#include <filesystem>
#include <string>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/fusion_options.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/fusion/fusion_report.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

enum class OutputType { kPly, kBinary, kText };

std::unique_ptr<CloudWriter> MakeWriter(const Workspace& workspace, const std::filesystem::path& path,
                                        OutputType type) {
  if (type == OutputType::kPly)
    return MakePlyCloudWriter({.path = path, .offset = ChooseWorldOffset(workspace)});
  return MakeSparseCloudWriter(workspace.model(), path,
                               type == OutputType::kBinary ? SparseFormat::kBinary : SparseFormat::kText);
}

void LogReport(const SceneFusionReport& report, const std::filesystem::path& path) {
  phi::LogInfo(path.string() + ": " + std::to_string(report.num_points) + " points from " +
               std::to_string(report.num_images) + " images, " + std::to_string(report.num_map_reads) +
               " maps read");
  const std::string smoothing = DescribeSmoothing(report);
  if (!smoothing.empty()) phi::LogInfo(smoothing);
  const std::string explanation = ExplainFewPoints(report);
  const std::string histogram = "what became of the pixels:\n" + OutcomeHistogram(report.outcomes);
  if (explanation.empty()) {
    phi::LogInfo(histogram);
  } else {
    phi::LogWarning("fusion: few pixels gave points; " + histogram + "\nlikely cause: " + explanation);
  }
}

}  // namespace

int RunStereoFusion(int argc, char** argv) {
  FusionCommandOptions options;
  std::filesystem::path output_path;
  OutputType output_type = OutputType::kPly;
  OptionParser parser("stereo_fusion", "Fuse depth and normal maps into a coloured point cloud");
  parser.Add("output_path", &output_path, "The .ply file, or the folder of a sparse model for BIN and TXT")
      .Required();
  parser.AddChoice("output_type", &output_type,
                   {{"PLY", OutputType::kPly}, {"BIN", OutputType::kBinary}, {"TXT", OutputType::kText}},
                   "Format; BIN and TXT: COLMAP's sparse model with the cloud as its points");
  options.Register(&parser);
  if (!parser.Parse(argc, argv)) return static_cast<int>(phi::ExitCode::kOk);
  options.Finish(parser);
  options.fusion.scratch_folder = output_type == OutputType::kPly ? output_path.parent_path() : output_path;

  const Workspace workspace(options.workspace);
  const std::unique_ptr<CloudWriter> writer = MakeWriter(workspace, output_path, output_type);
  const SceneFusionReport report = FuseScene(workspace, options.fusion, writer.get());
  writer->Commit();
  LogReport(report, output_path);
  if (report.failures.empty()) return static_cast<int>(phi::ExitCode::kOk);
  phi::LogError("fusion: " + std::to_string(report.failures.size()) +
                " images were left out, see above; the cloud is made of the other " +
                std::to_string(report.num_images));
  return static_cast<int>(phi::ExitCode::kSomeImagesFailed);
}

}  // namespace colmap_ext

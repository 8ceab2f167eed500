// phimvs stereo_fusion: fuses the maps of a workspace into a coloured point cloud. COLMAP's options and files.
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/shard_options.h"
#include "colmap_ext/cli/steps.h"
#include "colmap_ext/failure_text.h"
#include "colmap_ext/fusion/empty_box.h"
#include "colmap_ext/fusion/fusion_report.h"
#include "colmap_ext/fusion/fusion_shards.h"
#include "colmap_ext/fusion/replaced_model.h"
#include "colmap_ext/fusion/tile_list.h"
#include "colmap_ext/map_scale.h"
#include "colmap_ext/missing_images.h"
#include "colmap_ext/pipeline/stale_maps.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "colmap_ext/progress.h"
#include "colmap_ext/rig_frames.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// num_files: that the points went to.
void LogReport(const SceneFusionReport& report, const CloudOutput& output, std::size_t num_files, double seconds) {
  const std::string smoothing = DescribeSmoothing(report);
  if (!smoothing.empty()) phi::LogInfo(smoothing);
  phi::LogDebug(std::to_string(report.num_map_reads) + " maps were read");
  const std::string explanation = ExplainFewPoints(report);
  const std::string histogram = "what became of the pixels:\n" + OutcomeHistogram(report.outcomes);
  if (explanation.empty()) {
    phi::LogDebug(histogram);
  } else {
    phi::LogWarning("fusion: few pixels gave points; " + histogram + "\nlikely cause: " + explanation);
  }
  const bool is_tiled = output.tile_size > 0;
  const std::string tiles = is_tiled ? " in " + std::to_string(num_files) + " tiles" : "";
  phi::LogInfo((is_tiled ? TileListPath(output.path) : output.path).string() + ": " + std::to_string(report.num_points) + " points" +
               tiles + " from " + std::to_string(report.num_images) + " images in " + FormatDuration(seconds));
}

// Of two clouds with other options: each would leave its maps of some images. Null: none are written.
std::unique_ptr<WorkspaceLock> LockConfidenceMaps(const Workspace& workspace, const SceneFusionOptions& options,
                                                  WorkspaceLock::Sharing sharing) {
  if (!options.write_confidence_maps) return nullptr;
  return std::make_unique<WorkspaceLock>(workspace.ConfidenceMapsFolder(), sharing);
}

// Else an empty cloud would replace an earlier one, and parts that shards have made would be removed.
void RequireAFusedImage(const SceneFusionReport& report) {
  if (report.num_images > 0 || report.failures.empty()) return;
  throw phi::InputError(phi::AboutStage("fusion") + ": none of the " + std::to_string(report.failures.size()) +
                        " images can be fused: " + report.failures.front().text);
}

bool HasEarlierCloud(const CloudOutput& output) {
  std::error_code unreachable;
  const auto exists = [&](const std::filesystem::path& path) { return std::filesystem::exists(path, unreachable); };
  if (output.IsFile()) return exists(output.path) || exists(TileListPath(output.path));
  return exists(output.path / "points3D.bin") || exists(output.path / "points3D.txt");
}

// Throws phi::InputError where nothing is left.
void SubtractLeftOut(const CloudWriter& writer, const std::filesystem::path& path, SceneFusionReport* report) {
  const auto num_left_out = static_cast<std::int64_t>(writer.num_left_out());
  if (num_left_out > 0 && num_left_out == report->num_points) {
    throw phi::InputError(phi::AboutFile(path) + ": all " + std::to_string(num_left_out) +
                          " points are farther from the cameras than a LAS file reaches; name the output .ply");
  }
  report->num_points -= num_left_out;
  if (num_left_out > 0) {
    phi::LogWarning(phi::AboutFile(path) + ": " + std::to_string(num_left_out) +
                    " points are farther from the scene than its coordinates reach, and were left out");
  }
}

}  // namespace

int FuseMaps(FusionCommandOptions options, const CloudOutput& output, HandedMaps handed, std::unique_ptr<CloudLock> lock) {
  const auto begin = std::chrono::steady_clock::now();
  options.fusion.scratch_folder = output.IsFile() ? output.path.parent_path() : output.path;
  Workspace workspace(options.workspace);
  if (output.IsFile()) workspace.DropObservations();  // a sparse model has them again
  if (handed.kind().empty()) {  // of dense, the stereo has told, and made the maps
    WarnOfFrames(workspace);
    WarnOfMapScale(workspace, {options.fusion.input.kind});
  }
  for (const std::string& sentence : DescribeStaleMaps(workspace, options.fusion.input.kind)) {
    phi::LogWarning(sentence);
  }
  RequireAnImage(workspace);  // parts, too, are made anew without the photos
  RequireReplaceableModel(workspace, output);
  if (lock == nullptr) lock = std::make_unique<CloudLock>(output.path);
  const auto confidence_lock = LockConfidenceMaps(workspace, options.fusion, WorkspaceLock::Sharing::kAlone);
  const std::filesystem::path parts = PartsFolder(output.path);
  const bool has_parts = std::filesystem::is_directory(parts) && options.fusion.rule.method.formulas != phi::Formulas::kPaper;
  const std::unique_ptr<CloudWriter> writer = MakeCloudWriter(workspace, output);
  SceneFusionReport report = has_parts ? JoinParts(workspace, options.fusion, parts, writer.get())
                                       : FuseScene(workspace, &handed, options.fusion, writer.get());
  RequireAFusedImage(report);
  RequirePointsInBox(report, workspace, options.fusion, options.bbox_path);
  SubtractLeftOut(*writer, output.path, &report);
  const bool has_earlier = HasEarlierCloud(output);
  writer->Commit();
  RemoveOtherForm(output);
  if (has_parts) RemoveParts(parts);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  if (output.IsFile()) WriteFileAtomically(output.path.string() + ".json", FusionJson(report, elapsed.count()));
  LogReport(report, output, writer->num_files(), elapsed.count());
  // The file is written as COLMAP writes it: who calls the next program finds what these options give.
  if (report.num_points == 0 && has_earlier)
    phi::LogWarning(phi::AboutFile(output.path) + ": this cloud has no point, and has replaced the earlier one");
  if (options.fusion.write_confidence_maps)
    phi::LogInfo(workspace.ConfidenceMapsFolder().string() + ": how probably each pixel's depth is right");
  if (report.failures.empty()) return static_cast<int>(phi::ExitCode::kOk);
  const std::size_t num_left_out = report.failures.size();
  const std::string how_many = std::to_string(num_left_out) + " of " + std::to_string(num_left_out + report.num_images);
  phi::LogError(ListByReason("fusion: " + how_many + " images were left out, and the cloud is made of the others:", report.failures));
  return static_cast<int>(phi::ExitCode::kSomeImagesFailed);
}

namespace {

int FuseOneShard(FusionCommandOptions options, const CloudOutput& output, const Shard& shard) {
  const std::filesystem::path parts = PartsFolder(output.path);
  KeepLeftOvers();
  options.fusion.scratch_folder = parts;
  Workspace workspace(options.workspace);
  RequireAnImage(workspace);
  workspace.DropObservations();
  WarnOfMapScale(workspace, {options.fusion.input.kind});
  RequireReplaceableModel(workspace, output);  // not only when all parts are made
  std::filesystem::create_directories(parts);
  const auto confidence_lock = LockConfidenceMaps(workspace, options.fusion, WorkspaceLock::Sharing::kWithShards);
  const ShardFusionReport report = FuseShard(workspace, options.fusion, parts, shard);
  phi::LogInfo("shard " + shard.Name() + ": " + std::to_string(report.num_made) + " of " +
               std::to_string(report.num_parts) + " parts made, with " + std::to_string(report.num_points) +
               " points; the same command without --shard joins them");
  if (report.num_waiting > 0) return static_cast<int>(kRetryLater);
  return static_cast<int>(report.num_failures > 0 ? phi::ExitCode::kSomeImagesFailed : phi::ExitCode::kOk);
}

}  // namespace

int RunStereoFusion(int argc, char** argv) {
  FusionCommandOptions options;
  CloudOutput output;
  OptionParser parser("stereo_fusion", "Fuse depth and normal maps into a coloured point cloud");
  parser.Add("output_path", &output.path, "The .ply or .las file, or the folder of a sparse model for BIN and TXT")
      .Required();
  parser.Append(output.List());
  options.Register(&parser);
  ShardOptions shard_options;
  parser.Append(shard_options.List());
  if (!parser.Parse(argc, argv)) return static_cast<int>(phi::ExitCode::kOk);
  options.Finish(parser);
  output.Resolve();
  const Shard shard = shard_options.Resolve();
  return shard.IsWhole() ? FuseMaps(options, output) : FuseOneShard(options, output, shard);
}

}  // namespace colmap_ext

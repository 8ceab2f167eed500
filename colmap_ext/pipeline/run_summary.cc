#include "colmap_ext/pipeline/run_summary.h"

#include <sys/resource.h>

#include <algorithm>

#include "colmap_ext/failure_text.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/json_file.h"
#include "colmap_ext/pipeline/shard.h"
#include "colmap_ext/progress.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

constexpr double kMega = 1e6, kGiga = 1e9;

double Percent(std::int64_t part, std::int64_t whole) { return whole > 0 ? 100.0 * part / whole : 0.0; }

void AddInferenceLines(const InferenceSummary& s, std::vector<std::string>* lines) {
  if (s.num_holes == 0) return;
  lines->push_back(
      FormatText("holes: %.1f %% inferred (%.1f %% with, %.1f %% without a measurement that agrees), %.1f %% "
             "kept by the second filter",
             Percent(s.num_confirmed + s.num_alone, s.num_holes), Percent(s.num_confirmed, s.num_holes),
             Percent(s.num_alone, s.num_holes), Percent(s.num_kept, s.num_holes)));
  const phi::FieldStatistics& f = s.field;
  if (f.num_nodes == 0) return;
  lines->push_back(FormatText("%.1f %% of the holes have no hypothesis",
                          Percent(f.num_without_hypothesis, f.num_nodes + f.num_without_hypothesis)));
  lines->push_back(FormatText(
      "field: energy %.0f, lower bound %.0f, of cheapest hypotheses %.0f; %.1f %% of %lld nodes differ "
      "from the cheapest",
      f.energy, f.lower_bound, f.min_cost_energy, Percent(f.num_unlike_min_cost, f.num_nodes),
      static_cast<long long>(f.num_nodes)));
}

nlohmann::ordered_json InferenceJson(const InferenceSummary& s) {
  const phi::FieldStatistics& f = s.field;
  return {{"holes", s.num_holes},
          {"inferred_confirmed", s.num_confirmed},
          {"inferred_alone", s.num_alone},
          {"kept", s.num_kept},
          {"nodes", f.num_nodes},
          {"nodes_unlike_min_cost", f.num_unlike_min_cost},
          {"holes_without_hypothesis", f.num_without_hypothesis},
          {"energy", f.energy},
          {"lower_bound", f.lower_bound},
          {"min_cost_energy", f.min_cost_energy}};
}

}  // namespace

std::int64_t PeakHostBytes() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return std::int64_t{1024} * usage.ru_maxrss;
}

phi::ExitCode RunSummary::Code() const {
  if (num_waiting > 0) return kRetryLater;
  const phi::ExitCode code = phi::CodeOfFailures(failures.size(), static_cast<std::size_t>(num_images));
  const bool is_resource = !failures.empty() && static_cast<std::size_t>(num_too_large) == failures.size();
  return code == phi::ExitCode::kBadInput && is_resource ? phi::ExitCode::kOutOfResources : code;
}

// One that fails may have had its last map, and counts as kept then: max, here and below.
int RunSummary::NumDone() const {
  return std::max(0, num_images - num_images_waiting - num_failed_earlier - static_cast<int>(failures.size()));
}

int RunSummary::NumMade() const { return std::max(0, NumDone() - num_images_kept); }

DeviceSummary SummarizeDevice(const phi::Backend& backend) {
  return {backend.Name(), backend.PeakDeviceBytes(), backend.DeviceStageTimes()};
}

std::string SummaryLine(const RunSummary& summary) {
  const int num_failed = static_cast<int>(summary.failures.size());
  const int num_done = summary.NumDone();
  std::string text = FormatText("%d images", summary.num_images);
  if (num_done < summary.num_images) text = FormatText("%d of ", num_done) + text;
  const bool is_idle = std::all_of(summary.stages.begin(), summary.stages.end(),
                                   [](const StageSummary& stage) { return stage.num_made == 0; });
  const bool has_all = summary.num_images_kept == summary.num_images;
  if (has_all && summary.num_waiting == 0 && is_idle && num_failed == 0)
    return text + ": all maps are there and up to date, nothing to do";
  text += " done in " + FormatDuration(summary.seconds);
  if (summary.num_images_kept > 0) text += FormatText(", %d of them kept from before", summary.num_images_kept);
  if (num_failed > 0) text += FormatText(", %d failed", num_failed);
  if (summary.num_failed_earlier > 0) text += FormatText(", %d failed in earlier stages", summary.num_failed_earlier);
  if (summary.num_waiting > 0) text += FormatText(", %d tasks wait for other shards", summary.num_waiting);
  const StageSummary& last = summary.stages.back();
  if (last.num_pixels > 0) {
    text += FormatText("; depth at %.1f %% of the pixels", Percent(last.num_with_depth, last.num_pixels));
    if (summary.inference.num_kept > 0)
      text += FormatText(", %.1f %% inferred", Percent(summary.inference.num_kept, last.num_pixels));
  }
  text += FormatText("; most memory %.1f GB", summary.peak_host_bytes / kGiga);
  for (const DeviceSummary& device : summary.devices) {
    if (device.peak_bytes > 0) text += FormatText(", %.1f GB on %s", device.peak_bytes / kGiga, device.name.c_str());
  }
  return text;
}

std::vector<std::string> SummaryDetails(const RunSummary& summary) {
  std::vector<std::string> lines;
  for (const StageSummary& stage : summary.stages) {
    if (stage.num_made == 0) continue;
    std::string line = FormatText("time: %-12s %9.2f s, %d images, %.3f s/image", stage.name.c_str(),
                              stage.seconds, stage.num_made, stage.seconds / stage.num_made);
    if (stage.num_pixels > 0)
      line += FormatText(", depth at %.1f %% of the pixels", Percent(stage.num_with_depth, stage.num_pixels));
    lines.push_back(std::move(line));
  }
  AddInferenceLines(summary.inference, &lines);
  lines.push_back(FormatText("time: %-12s %9.2f s, %.3f images/s (%d images, %d kept from an earlier run)", "all",
                         summary.seconds, summary.seconds > 0 ? summary.NumMade() / summary.seconds : 0.0,
                         summary.num_images, summary.num_images_kept));
  lines.push_back(FormatText("memory: peak %.0f MB on the host, of it %.0f MB cached images and maps",
                         summary.peak_host_bytes / kMega, summary.peak_cache_bytes / kMega));
  lines.push_back(
      FormatText("disk: %.0f MB of maps written, %.0f MB/s per writer", summary.bytes_written / kMega,
             summary.write_seconds > 0 ? summary.bytes_written / kMega / summary.write_seconds : 0.0));
  return lines;
}

void LogSummary(const RunSummary& summary) {
  for (const std::string& line : SummaryDetails(summary)) phi::LogDebug(line);
  if (!summary.left_out.empty()) {
    const std::size_t num_left_out = summary.left_out.size();
    phi::LogWarning(ListByReason(FormatText("%zu of %zu images were left out:", num_left_out, num_left_out + summary.num_images),
                                 summary.left_out));
  }
  if (!summary.failures.empty()) {
    phi::LogError(
        ListByReason(FormatText("%zu of %d images failed:", summary.failures.size(), summary.num_images), summary.failures));
  }
  phi::LogInfo(SummaryLine(summary));
}

std::string SummaryJson(const RunSummary& summary, const std::string& finished) {
  using Json = nlohmann::ordered_json;
  Json stages = Json::array(), devices = Json::array();
  for (const StageSummary& stage : summary.stages) {
    if (stage.num_made == 0) continue;
    stages.push_back({{"stage", stage.name}, {"images", stage.num_made}, {"seconds", stage.seconds}});
    if (stage.num_pixels > 0) {
      stages.back()["pixels"] = stage.num_pixels;
      stages.back()["pixels_with_depth"] = stage.num_with_depth;
    }
  }
  for (const DeviceSummary& device : summary.devices) {
    Json times = Json::array();
    for (const phi::DeviceStageTime& time : device.stages) {
      Json entry = {{"stage", time.stage}, {"images", time.num_images}, {"seconds", time.seconds}};
      if (time.num_samples > 0) entry["samples_per_second"] = time.num_samples / time.seconds;
      times.push_back(entry);
    }
    devices.push_back({{"name", device.name}, {"peak_memory_bytes", device.peak_bytes}, {"stages", times}});
  }
  Json json = {{"finished", finished},
               {"seconds", summary.seconds},
               {"images", summary.num_images},
               {"images_kept", summary.num_images_kept},
               {"images_made", summary.NumMade()},
               {"images_failed", summary.failures.size()},
               {"images_per_second", summary.seconds > 0 ? summary.NumMade() / summary.seconds : 0.0},
               {"stages", stages},
               {"devices", devices},
               {"peak_memory_bytes", summary.peak_host_bytes},
               {"peak_cache_bytes", summary.peak_cache_bytes},
               {"bytes_written", summary.bytes_written},
               {"bytes_per_second_and_writer",
                summary.write_seconds > 0 ? summary.bytes_written / summary.write_seconds : 0.0}};
  if (summary.inference.num_holes > 0) json["inference"] = InferenceJson(summary.inference);
  return DumpJson(json, -1);
}

}  // namespace colmap_ext

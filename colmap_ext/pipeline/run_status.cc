#include "colmap_ext/pipeline/run_status.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "colmap_ext/failure_text.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/progress.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {
namespace {

using KindOfRecords = std::map<std::string, TaskRecord>;  // by kind of result

// As the latest shard says; without shards those of the records.
std::vector<std::string> StageNames(const std::vector<ShardProcess>& shards,
                                    const std::map<std::string, KindOfRecords>& images) {
  const auto latest = std::max_element(
      shards.begin(), shards.end(),
      [](const ShardProcess& a, const ShardProcess& b) { return a.generation < b.generation; });
  if (latest != shards.end()) return latest->stages;
  std::vector<std::string> names;
  for (const std::string_view kind : {kPhotometric, kMeasured, kGeometric}) {
    const bool is_there = std::any_of(images.begin(), images.end(), [&](const auto& image) {
      return image.second.contains(std::string(kind));
    });
    if (is_there) names.emplace_back(kind);
  }
  return names;
}

// Whether the image gets no map of this stage any more.
bool Count(const TaskRecord* record, const std::string& options_hash, bool has_failed, StageStatus* stage,
           double* seconds) {
  const bool is_current = record != nullptr && record->IsOfOptions(options_hash);
  if (is_current && record->state == "done") {
    ++stage->num_done;
    *seconds += record->seconds;
    return false;
  }
  has_failed |= is_current && record->state == "failed";
  ++(has_failed ? stage->num_failed : stage->num_waiting);
  return has_failed;
}

void AddShards(const std::vector<ShardProcess>& shards, RunStatus* status) {
  std::map<std::string, ShardProcess> latest;  // by shard: it may have been started again
  for (const ShardProcess& process : shards) {
    ShardProcess& known = latest[process.shard];
    if (process.generation >= known.generation) known = process;
  }
  for (const auto& [name, process] : latest) {
    if (process.has_ended || name.empty()) continue;
    status->open_shards.push_back(name);
    status->pace += process.num_workers;
  }
}

void FindTimeLeft(RunStatus* status) {
  double seconds = 0;
  bool is_known = false;
  for (const StageStatus& stage : status->stages) {
    if (stage.num_waiting == 0) continue;
    if (stage.num_done > 0) {
      is_known = status->pace > 0;
      seconds += stage.num_waiting * stage.seconds_per_image;
    } else if (status->unknown_stage.empty()) {
      status->unknown_stage = stage.name;
    }
  }
  const bool is_done = seconds == 0 && status->unknown_stage.empty();
  if (!is_done) status->seconds_left = is_known ? seconds / status->pace : -1;
}

std::string TimeText(const RunStatus& status) {
  const std::string none = status.unknown_stage.empty() ? "" : "no " + status.unknown_stage + " map is done yet";
  if (status.seconds_left < 0) return "not known: " + (status.pace > 0 ? none : "the run has finished no map yet");
  if (none.empty()) return "about " + FormatDuration(status.seconds_left);
  return "more than " + FormatDuration(status.seconds_left) + ": " + none;
}

// Who is at work, and how to go on where nobody is.
std::string WorkText(const std::vector<std::string>& open_shards, LockUse use, bool has_waiting) {
  std::string text;
  if (!open_shards.empty()) {
    text += use == LockUse::kFree ? "shards at work on other computers" : "shards at work";
    text += ", or killed and not started again:";
    for (const std::string& shard : open_shards) text += " " + shard;
    text += "\n";
  }
  if (use == LockUse::kHeld) return text + "a run is at work on this computer\n";
  if (!has_waiting || (use == LockUse::kFree && !open_shards.empty())) return text;
  if (use == LockUse::kUnknown) {
    return text + "whether a run is at work cannot be told: this file system has no locks\n";
  }
  return text + "no run is at work on this computer; the same command goes on where the last one stopped\n";
}

}  // namespace

RunStatus FindStatus(const RunRecord& record) {
  const std::vector<ShardProcess> shards = record.ShardsSinceWholeRun();
  std::map<std::string, KindOfRecords> images;
  for (auto& [task, known] : record.Tasks()) {
    // A run of all images has marked what it is to make. Shards have not: of theirs, earlier maps wait.
    if (shards.empty() && !known.IsOfOptions(record.options_hash())) continue;
    images[task.first][task.second] = std::move(known);
  }
  RunStatus status;
  status.num_images = static_cast<int>(images.size());
  for (const ShardProcess& process : shards)
    status.num_images = std::max(status.num_images, process.num_images);
  std::set<std::string> failed;
  for (const std::string& name : StageNames(shards, images)) {
    StageStatus stage{.name = name};
    double seconds = 0;
    for (const auto& [image, records] : images) {
      const auto found = records.find(name);
      const TaskRecord* known = found == records.end() ? nullptr : &found->second;
      if (!Count(known, record.options_hash(), failed.contains(image), &stage, &seconds)) continue;
      if (!failed.insert(image).second) continue;
      status.failures.push_back(WithContext(known->warnings.empty() ? "" : known->warnings.front(),
                                            phi::AboutImage(image) + phi::AboutStage(name)));
    }
    stage.num_waiting +=
        status.num_images - static_cast<int>(images.size());  // of which there is no record at all
    if (stage.num_done > 0) stage.seconds_per_image = seconds / stage.num_done;
    status.stages.push_back(stage);
  }
  AddShards(shards, &status);
  if (status.open_shards.empty()) status.pace = record.Pace();
  FindTimeLeft(&status);
  return status;
}

std::string StatusText(const RunStatus& status, LockUse use) {
  std::string text = std::to_string(status.num_images) + " images\n";
  text += FormatText("%-14s %8s %8s %8s %10s\n", "stage", "done", "failed", "waiting", "s/image");
  int num_waiting = 0;
  for (const StageStatus& stage : status.stages) {
    text += FormatText("%-14s %8d %8d %8d %10.3f\n", stage.name.c_str(), stage.num_done, stage.num_failed,
                       stage.num_waiting, stage.seconds_per_image);
    num_waiting += stage.num_waiting;
  }
  text += WorkText(status.open_shards, use, num_waiting > 0);
  if (num_waiting > 0 && (use != LockUse::kFree || !status.open_shards.empty())) {
    text += "time left: " + TimeText(status) + "\n";
  }
  for (const phi::Message& failure : status.failures) text += "failed: " + DescribeFailure(failure) + "\n";
  return text;
}

}  // namespace colmap_ext

#include "colmap_ext/pipeline/stereo_pipeline.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <set>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/result_key.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

std::string OptionsHash(const std::vector<Stage>& stages) {
  ResultKey key;
  for (const Stage& stage : stages) key.Add(stage.result).Add(stage.options);
  return key.Hex();
}

// What users read is COLMAP's.
std::set<std::string> CompactKinds(const std::vector<Stage>& stages) {
  std::set<std::string> kinds;
  for (const Stage& stage : stages) {
    if (stage.is_rounded) kinds.insert(stage.result);
  }
  kinds.erase(stages.back().result);
  return kinds;
}

std::vector<int> OwnJobs(const PlanScope& scope, std::size_t num_jobs) {
  std::vector<int> own;
  for (std::size_t j = 0; j < num_jobs; ++j) {
    if (scope.own.empty() || scope.own[j] != 0) own.push_back(static_cast<int>(j));
  }
  return own;
}

}  // namespace

StereoPipeline::StereoPipeline(SceneJobs scene, const PipelineOptions& options,
                               const std::map<std::string, std::string>& effective_options, const Backends& backends,
                               const Shard& shard)
    : workspace_(scene.workspace),
      options_(options),
      jobs_(std::move(scene.jobs)),
      stages_(StagesOf(options, shard)),
      shard_(shard),
      scope_(ScopeOf(stages_, shard, static_cast<int>(jobs_.size()))),
      own_(OwnJobs(scope_, jobs_.size())),
      backends_(backends),
      runner_(workspace_, jobs_, options_, std::move(scene.sparse_depth), backends) {
  runner_.record().SetOptions(effective_options, OptionsHash(stages_));
  if (options_.compact_maps) runner_.store().WriteCompactly(CompactKinds(stages_));
  runner_.summary().num_images = static_cast<int>(own_.size());
  if (IsShard()) BeginShard();
}

void StereoPipeline::BeginShard() {
  ShardProcess process;
  process.shard = shard_.Name();
  process.only_stage = shard_.only_stage;
  process.num_images = static_cast<int>(jobs_.size());
  process.num_workers = NumAtOnce(backends_);
  for (const Stage& stage : stages_) process.stages.push_back(stage.result);
  runner_.record().BeginShard(std::move(process));
}

RunSummary StereoPipeline::Run() {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  CheckFiles();
  ReportImpossibleJobs();
  RequirePossibleJob();
  WarnOfFewWitnesses();
  runner_.Begin(stages_);
  RunStages();
  if (!IsShard()) ConvertMaps();  // others may read them now
  runner_.End();
  if (!IsShard()) RemoveIntermediateFiles();
  RunSummary& summary = runner_.summary();
  summary.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  if (had_work_) runner_.AddToRecord();
  runner_.record().Compact();
  WarnOfEmptyMaps();
  return summary;
}

HandedMaps StereoPipeline::HandOver() {
  const std::string& kind = stages_.back().result;
  HandedMaps handed(kind, workspace_.views().size());
  for (const ImageJob& job : jobs_) {
    const MapStore& store = runner_.store();
    handed.Set(job.image, {.map = store.FindMap(job.image, kind), .photo = store.FindPhoto(job.image)});
  }
  return handed;
}

void StereoPipeline::RunStages() {
  std::vector<StagePlan> plan = Plan();
  const std::size_t last = static_cast<std::size_t>(std::min<int>(scope_.end_stage, static_cast<int>(plan.size()))) - 1;
  CountKept(plan[last]);
  ConfirmKeptMaps(plan);  // at once: the run may be killed
  if (had_work_ && !IsShard()) RecordImpossibleJobs();  // a finished workspace may be read-only
  LogPlan(plan);
  while (HasPending(plan)) {
    runner_.Run(plan);
    if (IsShard()) runner_.record().Refresh();
    plan = Plan();
    ConfirmKeptMaps(plan);  // what is kept without an image that failed is known now
  }
  runner_.summary().num_images_waiting = static_cast<int>(plan[last].waiting.size());
  ReportWaiting(plan);
}

// A job without a key can have no result.
void StereoPipeline::CountKept(const StagePlan& last) {
  RunSummary& summary = runner_.summary();
  had_work_ = !last.pending.empty() || !last.waiting.empty();
  const auto num_possible = std::count_if(own_.begin(), own_.end(), [&](int job) { return !last.keys[job].empty(); });
  const auto num_without_problem =
      std::count_if(own_.begin(), own_.end(), [&](int job) { return jobs_[job].problem.empty(); });
  summary.num_images_kept = static_cast<int>(num_possible - std::ssize(last.pending) - std::ssize(last.waiting));
  summary.num_failed_earlier = static_cast<int>(num_without_problem - num_possible);
}

// The first stage's that has any: those after it wait for the same.
void StereoPipeline::ReportWaiting(const std::vector<StagePlan>& plan) {
  for (std::size_t s = 0; s < plan.size(); ++s) {
    const std::vector<WaitingTask>& waiting = plan[s].waiting;
    runner_.summary().num_waiting += static_cast<int>(waiting.size());
    if (waiting.empty() || runner_.summary().num_waiting > static_cast<int>(waiting.size())) continue;
    phi::LogWarning(stages_[s].result + " maps of " + std::to_string(waiting.size()) + " images wait for " +
                    stages_[s - 1].result + " maps that other shards have not made yet: " + NameOf(waiting.front().job) +
                    " for that of " + NameOf(waiting.front().input_job) + "; run this shard again later");
  }
}

// What runs where, and about how long.
void StereoPipeline::LogPlan(const std::vector<StagePlan>& plan) {
  std::string text = DescribeJobs(workspace_, jobs_);
  if (IsShard()) text += ", shard " + shard_.Name() + " with " + std::to_string(own_.size()) + " of them";
  const int num_done = runner_.summary().num_images_kept;
  if (num_done > 0) text += ", " + std::to_string(num_done) + " of them done";
  double speed = 0, work = 0;  // pixels times source views
  for (const auto& backend : backends_) {
    text += ", " + backend->Name();
    speed += backend->ExpectedPixelViewsPerSecond();
  }
  double weight = 0;  // of an image's estimation: all that follows included
  for (const Stage& stage : stages_) weight += stage.weight;
  for (const int job : plan[static_cast<std::size_t>(scope_.first_stage)].pending) {
    const phi::Pinhole& size = workspace_.views()[jobs_[job].image].camera.pinhole;
    work += weight * size.width * size.height * static_cast<double>(jobs_[job].NumMatched());
  }
  if (speed > 0 && work > 0) text += ", about " + FormatDuration(work / speed);
  phi::LogInfo(text);
}

// The filters ask for so many source views that confirm a pixel, and only views with maps of their own can.
void StereoPipeline::WarnOfFewWitnesses() const {
  const int needed = options_.filter.min_num_consistent;
  if (!options_.filter_maps) return;
  int num_affected = 0, first = -1;
  for (const int j : own_) {
    const auto has_maps = [&](int source) { return source >= 0 && jobs_[source].problem.empty(); };
    const auto& sources = jobs_[j].source_jobs;
    if (!jobs_[j].problem.empty() || std::count_if(sources.begin(), sources.end(), has_maps) >= needed)
      continue;
    ++num_affected;
    if (first < 0) first = j;
  }
  if (num_affected == 0) return;
  const bool accepts_few = options_.filter.method.FormulasOf(phi::Rule::kFewViews) == phi::Formulas::kRobust;
  phi::LogWarning(
      (accepts_few ? "only what no source image contradicts will be kept of " : "nothing will be kept of ") +
      std::to_string(num_affected) + " of " + std::to_string(own_.size()) + " images, " + NameOf(first) +
      " the first: they have fewer than " + std::to_string(needed) +
      " source images that are estimated too, and --PatchMatchStereo.filter_min_num_consistent asks for so "
      "many to confirm a pixel; name more images in patch-match.cfg, or ask for fewer");
}

void StereoPipeline::WarnOfEmptyMaps() {
  const std::vector<int>& empty = runner_.nearly_empty();
  if (empty.empty()) return;
  const StageSummary& last = runner_.summary().stages.back();
  phi::LogWarning("hardly a pixel of the " + last.name + " maps of " + std::to_string(empty.size()) +
                  " of " + std::to_string(last.num_made) + " images has depth, " + NameOf(empty.front()) +
                  " the first: they may show no texture, masks may hide it, or their poses do not fit them; `phimvs "
                  "map_inspector --map_kind photometric` shows what there was before the filter");
}

void StereoPipeline::ReportImpossibleJobs() {
  for (const int j : own_) {
    if (jobs_[j].problem.empty()) continue;
    if (jobs_[j].file_is_missing && options_.allow_missing_files) {
      runner_.LeaveOut(jobs_[j].problem);
      continue;
    }
    runner_.Fail(j, stages_[0].result, jobs_[j].problem);
    if (!IsShard() || !scope_.Owns(0, j)) continue;
    runner_.record().FailAll({{NameOf(j), stages_[0].result}}, {jobs_[j].problem.text});  // for `status`, which plans nothing
  }
}

// For `status`, as shards do. Maps of these options, of an image whose photo is away for once, stay done.
void StereoPipeline::RecordImpossibleJobs() {
  RunRecord& record = runner_.record();
  std::vector<RunRecord::Task> tasks;
  std::vector<std::string> why;
  for (const phi::Message& failure : runner_.summary().failures) {
    const auto known = record.Find(failure.image, failure.stage);
    if (known && known->state == "done" && known->IsOfOptions(record.options_hash())) continue;
    tasks.emplace_back(failure.image, failure.stage);
    why.push_back(failure.text);
  }
  record.FailAll(tasks, why);
}

// Most likely a folder was moved or is not mounted, which must not look like success. Of images out of its reach a shard
// knows no problem.
void StereoPipeline::RequirePossibleJob() {
  const phi::Message problem = DescribeImpossible(jobs_, stages_[0].result);
  if (problem.empty()) return;
  if (IsShard()) runner_.record().Compact();  // else `status` would take it for one at work
  throw phi::InputError(problem);
}

// Files of many images are asked for side by side here and below: a shared disk takes half a millisecond to answer.
void StereoPipeline::CheckFiles() {
  files_whole_.assign(stages_.size(), std::vector<char>(jobs_.size(), 0));
  for (std::size_t s = 0; s < stages_.size(); ++s) {
    if (stages_[s].transient) continue;
    std::vector<FoundFiles> found(own_.size());
    tbb::parallel_for(std::size_t{0}, own_.size(), [&](std::size_t i) { found[i] = Inspect(static_cast<int>(s), own_[i]); });
    for (std::size_t i = 0; i < own_.size(); ++i) {
      if (stages_[s].is_output && !options_.overwrite) RefuseForeignFile(found[i].foreign);
      files_whole_[s][own_[i]] = found[i].whole;
    }
  }
}

FoundFiles StereoPipeline::Inspect(int stage, int job) const {
  const auto record = runner_.record().Find(NameOf(job), stages_[stage].result);
  return runner_.store().Inspect(jobs_[job].image, stages_[stage].result, WritesCost(stage), stages_[stage].has_mask,
                                 record ? &*record : nullptr);
}

void StereoPipeline::RefuseForeignFile(const std::filesystem::path& path) const {
  if (path.empty()) return;
  throw phi::InputError(
      phi::AboutFile(path) +
      " was not made by phimvs patch_match_stereo; add --overwrite true to replace it and all "
      "others like it, or move it and the others away" +
      (runner_.record().Shards().empty()
           ? ""
           : "; if a shard on another computer made it, its record is not to be seen here yet: run the command again later"));
}

std::vector<StagePlan> StereoPipeline::Plan() const {
  return runner_.Plan(
      {.is_done = [this](int stage, int job, const std::string& key) { return WasDone(stage, job, key); },
       .has_failed = [this](int stage, int job,
                            const std::string& key) { return FailedElsewhere(stage, job, key); }},
      scope_);
}

bool StereoPipeline::WasDone(int stage, int job, const std::string& key) const {
  if (!runner_.record().Has({NameOf(job), stages_[stage].result}, "done", key)) return false;
  // Those of other shards come while this one runs.
  return scope_.Owns(stage, job) ? files_whole_[stage][job] != 0 : Inspect(stage, job).whole;
}

bool StereoPipeline::FailedElsewhere(int stage, int job, const std::string& key) const {
  return !scope_.Owns(stage, job) && runner_.record().Has({NameOf(job), stages_[stage].result}, "failed", key);
}

// They are rounded whatever their form, so that no value changes.
void StereoPipeline::ConvertMaps() {
  MapStore& store = runner_.store();
  for (int s = 0; s < static_cast<int>(stages_.size()); ++s) {
    const std::string& kind = stages_[s].result;
    for (const int job : own_) {
      const int image = jobs_[job].image;
      if (!stages_[s].is_output || !stages_[s].is_rounded) continue;
      if (store.IsCompact(image, kind) == store.WritesCompactly(kind)) continue;
      const RunRecord::Task task{NameOf(job), kind};
      const auto record = runner_.record().Find(task.first, task.second);
      if (!record || record->state != "done" || !Inspect(s, job).whole) continue;
      StageResult result{.map = store.Map(image, kind)};
      if (WritesCost(s)) result.cost = store.Cost(image, kind);
      store.Write(image, kind, result, [this, task, both = *record](const std::vector<FileIdentity>& files) mutable {
        // Of both forms: a process that is killed here leaves one of them, and either is this result.
        both.files.insert(both.files.end(), files.begin(), files.end());
        runner_.record().Finish(task, both);
      });
    }
  }
}

// Those that are up to date are this run's as much as those that it makes, also while it is at work and where it is killed.
void StereoPipeline::ConfirmKeptMaps(const std::vector<StagePlan>& plan) {
  if (IsShard()) return;
  for (std::size_t s = 0; s < stages_.size(); ++s) {
    for (std::size_t j = 0; j < jobs_.size() && stages_[s].is_output; ++j) {
      const std::string& key = plan[s].keys[j];
      const int stage = static_cast<int>(s), job = static_cast<int>(j);
      if (!key.empty() && WasDone(stage, job, key))
        runner_.record().Confirm({NameOf(job), stages_[s].result});
    }
  }
}

// Also those that a killed run with other options left. The record knows all estimates that are ours; maps of the other kinds
// get files without a record where memory has no place for them.
void StereoPipeline::RemoveIntermediateFiles() {
  for (const std::string_view view : kIntermediateKinds) {
    const std::string kind(view);
    tbb::parallel_for(std::size_t{0}, jobs_.size(), [&](std::size_t j) {
      const RunRecord::Task task{NameOf(static_cast<int>(j)), kind};
      if (kind == kRaw && !runner_.record().Find(task.first, kind)) return;
      runner_.store().RemoveFiles(jobs_[j].image, kind);
      runner_.record().Forget(task);
    });
  }
}

bool StereoPipeline::WritesCost(int stage) const {
  const bool makes_photometric = stages_[stage].result == kPhotometric;
  return options_.NeedsCost() && (makes_photometric || stages_[stage].kind == StageKind::kEstimate);
}

}  // namespace colmap_ext

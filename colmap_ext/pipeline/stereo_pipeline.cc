#include "colmap_ext/pipeline/stereo_pipeline.h"

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/result_key.h"
#include "colmap_ext/pipeline/task_queue.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/base/log.h"
#include "phi/base/utc_time.h"
#include "phi/base/whole_array.h"
#include "phi/matching/cost_aggregation.h"

namespace colmap_ext {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kHardlyAny = 0.01;  // of an image's pixels

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

int NumWorkers(const StereoPipeline::Backends& backends) {
  int num_workers = 0;
  for (const auto& backend : backends) num_workers += std::max(1, backend->NumConcurrentImages());
  return num_workers;
}

// Enough to keep up with several devices, few enough that what waits to be written stays small.
int NumWriters(const StereoPipeline::Backends& backends) { return std::clamp(NumWorkers(backends), 2, 8); }

std::string OptionsHash(const std::vector<Stage>& stages) {
  ResultKey key;
  for (const Stage& stage : stages) key.Add(stage.result).Add(stage.options);
  return key.Hex();
}

}  // namespace

StereoPipeline::StereoPipeline(const Workspace& workspace, std::vector<ImageJob> jobs,
                               SparseDepthFunction sparse_depth, const PipelineOptions& options,
                               const std::map<std::string, std::string>& effective_options,
                               const Backends& backends)
    : workspace_(workspace),
      options_(options),
      jobs_(std::move(jobs)),
      stages_(BuildStages(options)),
      backends_(backends),
      record_(workspace.StereoFolder()),
      store_(workspace, options.CacheBytes(), NumWriters(backends)),
      tasks_(workspace_, jobs_, options_, std::move(sparse_depth), &store_) {
  record_.SetOptions(effective_options, OptionsHash(stages_));
}

RunSummary StereoPipeline::Run() {
  const Clock::time_point begin = Clock::now();
  CheckFiles();
  std::vector<ProgressStage> progress_stages;
  for (const Stage& stage : stages_) {
    progress_stages.push_back({.name = ActivityName(stage.kind), .weight = stage.weight});
    summary_.stages.push_back({.name = stage.result});
  }
  ReportImpossibleJobs();
  WarnOfFewWitnesses();
  progress_ = std::make_unique<ProgressLine>(std::move(progress_stages));
  for (bool first = true;; first = false) {
    const std::vector<StagePlan> plan = Plan();
    for (std::size_t s = 0; s < stages_.size(); ++s) {
      progress_->SetNumTasks(static_cast<int>(s),
                             static_cast<int>(plan[s].pending.size()) + summary_.stages[s].num_made);
    }
    const auto next =
        std::find_if(plan.begin(), plan.end(), [](const StagePlan& p) { return !p.pending.empty(); });
    if (first) {
      summary_.num_images_kept = static_cast<int>(jobs_.size() - plan.back().pending.size());
      LogPlan(plan);
    }
    if (next == plan.end()) break;
    RunStage(static_cast<int>(next - plan.begin()), plan);
  }
  store_.Drain();
  ConfirmKeptMaps();
  RemoveIntermediateFiles();
  Summarize(SecondsSince(begin));
  if (summary_.num_images_kept < summary_.num_images) record_.AddRun(SummaryJson(summary_, phi::UtcNow()));
  record_.Compact();
  progress_.reset();
  WarnOfEmptyMaps();
  return summary_;
}

// What runs where, and about how long.
void StereoPipeline::LogPlan(const std::vector<StagePlan>& plan) const {
  std::string text = DescribeJobs(workspace_, jobs_);
  if (summary_.num_images_kept > 0) text += ", " + std::to_string(summary_.num_images_kept) + " of them done";
  double speed = 0, work = 0;  // pixels times source views
  for (const auto& backend : backends_) {
    text += ", " + backend->Name();
    speed += backend->ExpectedPixelViewsPerSecond();
  }
  double weight = 0;  // of an image's estimation: all that follows included
  for (const Stage& stage : stages_) weight += stage.weight;
  for (const int job : plan.front().pending) {
    const phi::Pinhole& size = workspace_.views()[jobs_[job].image].camera.pinhole;
    const std::size_t num_views = std::min<std::size_t>(jobs_[job].sources.size(), phi::kMaxSourceViews);
    work += weight * size.width * size.height * static_cast<double>(num_views);
  }
  if (speed > 0 && work > 0) text += ", about " + FormatDuration(work / speed);
  phi::LogInfo(text);
}

// The filters ask for so many source views that confirm a pixel, and only views with maps of their own can.
void StereoPipeline::WarnOfFewWitnesses() const {
  const int needed = options_.filter.min_num_consistent;
  if (!options_.filter_maps) return;
  int num_affected = 0, first = -1;
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    const auto has_maps = [&](int source) { return source >= 0 && jobs_[source].problem.empty(); };
    const auto& sources = jobs_[j].source_jobs;
    if (!jobs_[j].problem.empty() || std::count_if(sources.begin(), sources.end(), has_maps) >= needed)
      continue;
    ++num_affected;
    if (first < 0) first = static_cast<int>(j);
  }
  if (num_affected == 0) return;
  phi::LogWarning(
      "nothing will be kept of " + std::to_string(num_affected) + " of " + std::to_string(jobs_.size()) +
      " images, " + NameOf(first) + " the first: they have fewer than " + std::to_string(needed) +
      " source images that are estimated too, and --PatchMatchStereo.filter_min_num_consistent asks for so "
      "many to confirm a pixel; name more images in patch-match.cfg, or ask for fewer");
}

void StereoPipeline::WarnOfEmptyMaps() const {
  if (empty_.empty()) return;
  const StageSummary& last = summary_.stages.back();
  phi::LogWarning("hardly a pixel of the " + last.name + " maps of " + std::to_string(empty_.size()) +
                  " of " + std::to_string(last.num_made) + " images has depth, " + NameOf(*empty_.begin()) +
                  " the first: they may show no texture, or their poses do not fit them; `phimvs "
                  "map_inspector --map_kind photometric` shows what there was before the filter");
}

void StereoPipeline::ReportImpossibleJobs() {
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    if (jobs_[j].problem.empty()) continue;
    if (jobs_[j].file_is_missing && options_.allow_missing_files) {
      phi::LogWarning(jobs_[j].problem);
      continue;
    }
    phi::LogError(jobs_[j].problem);
    summary_.failures.push_back({NameOf(static_cast<int>(j)), stages_[0].result, jobs_[j].problem});
  }
}

void StereoPipeline::CheckFiles() {
  for (std::size_t s = 0; s < stages_.size(); ++s) {
    std::vector<char> whole(jobs_.size(), 0);
    for (std::size_t j = 0; j < jobs_.size() && !stages_[s].transient; ++j) {
      const int stage = static_cast<int>(s);
      const FoundFiles found =
          store_.Inspect(jobs_[j].image, stages_[s].result, WritesCost(stage), stages_[s].has_mask,
                         record_.Find(NameOf(static_cast<int>(j)), stages_[s].result));
      if (stages_[s].is_output && !options_.overwrite) RefuseForeignFile(found.foreign);
      whole[j] = found.whole;
    }
    files_whole_.push_back(std::move(whole));
  }
}

void StereoPipeline::RefuseForeignFile(const std::filesystem::path& path) {
  if (path.empty()) return;
  throw phi::InputError(
      path.string() +
      " was not made by phimvs patch_match_stereo; add --overwrite true to replace it and all "
      "others like it, or move stereo/depth_maps and stereo/normal_maps away");
}

std::vector<StagePlan> StereoPipeline::Plan() const {
  return MakePlan(
      stages_, jobs_,
      {.is_done = [this](int stage, int job, const std::string& key) { return IsDone(stage, job, key); },
       .has_failed =
           [this](int stage, int job) {
             return failed_.contains({stage, job});
           }});
}

bool StereoPipeline::IsDone(int stage, int job, const std::string& key) const {
  if (made_.contains({stage, job})) return true;
  if (!files_whole_[stage][job]) return false;
  const TaskRecord* record = record_.Find(NameOf(job), stages_[stage].result);
  return record && record->state == "done" && record->key == key;
}

void StereoPipeline::RunStage(int stage, const std::vector<StagePlan>& plan) {
  const std::vector<int>& pending = plan[stage].pending;
  if (!stages_[stage].transient) {
    std::vector<RunRecord::Task> tasks;
    std::vector<std::string> keys;
    for (const int job : pending) {
      tasks.emplace_back(NameOf(job), stages_[stage].result);
      keys.push_back(plan[stage].keys[job]);
    }
    record_.Begin(tasks, keys);
  }
  progress_->BeginStage(stage);
  const Clock::time_point begin = Clock::now();
  const auto failures = RunTasks(pending, backends_, [&](int job, phi::Backend& backend) {
    ProgressLine::Task progress(progress_.get());
    RunTask(stage, plan, job, backend, &progress);
  });
  if (stage > 0) {  // the only stage that reads those maps
    for (const ImageJob& job : jobs_) store_.Forget(job.image, stages_[stage - 1].result);
  }
  summary_.stages[stage].seconds += SecondsSince(begin);
  summary_.stages[stage].num_made += static_cast<int>(pending.size() - failures.size());
  RecordFailures(stage, plan, failures);
}

void StereoPipeline::RunTask(int stage, const std::vector<StagePlan>& plan, int job, phi::Backend& backend,
                             ProgressLine::Task* progress) {
  const Clock::time_point begin = Clock::now();
  const bool first = stage == 0;
  static const std::vector<std::string> kNoKeys;
  TaskRecord record;
  const StageResult result =
      tasks_.Run(stages_[stage], first ? nullptr : &stages_[stage - 1],
                 first ? kNoKeys : plan[stage - 1].keys, job, backend, progress, &record.warnings);
  for (const std::string& warning : record.warnings) phi::LogWarning("image " + NameOf(job) + ": " + warning);
  record.state = "done";
  record.key = plan[stage].keys[job];
  record.seconds = SecondsSince(begin);
  record.peak_memory_bytes = PeakHostBytes();
  Save(stage, job, result, record);
  const auto has_depth = [](const phi::PlaneHypothesis& h) { return h.depth > 0; };
  const std::int64_t num_with_depth = phi::CountIf(*result.map, has_depth);
  std::lock_guard<std::mutex> lock(mutex_);
  made_.emplace(stage, job);
  const bool last = stage + 1 == static_cast<int>(stages_.size());
  if (last && static_cast<double>(num_with_depth) < kHardlyAny * static_cast<double>(result.map->size()))
    empty_.insert(job);
  summary_.stages[stage].num_pixels += static_cast<std::int64_t>(result.map->size());
  summary_.stages[stage].num_with_depth += num_with_depth;
}

void StereoPipeline::Save(int stage, int job, const StageResult& result, const TaskRecord& record) {
  const std::string& kind = stages_[stage].result;
  if (stages_[stage].transient) {
    store_.KeepTransient(jobs_[job].image, kind, result);
    return;
  }
  store_.Write(jobs_[job].image, kind, result,
               [this, task = RunRecord::Task(NameOf(job), kind),
                record = record](const std::vector<FileIdentity>& files) mutable {
                 record.files = files;
                 record_.Finish(task, record);
               });
}

void StereoPipeline::RecordFailures(int stage, const std::vector<StagePlan>& plan,
                                    const std::vector<TaskFailure>& failures) {
  for (const TaskFailure& failure : failures) {
    failed_.emplace(stage, failure.task);
    phi::LogError(failure.message);
    summary_.failures.push_back({NameOf(failure.task), stages_[stage].result, failure.message});
    if (stages_[stage].transient) continue;
    TaskRecord record;
    record.state = "failed";
    record.key = plan[stage].keys[failure.task];
    record.warnings = {failure.message};
    record_.Finish({NameOf(failure.task), stages_[stage].result}, record);
  }
}

// Those that were up to date are this run's as much as those that it made.
void StereoPipeline::ConfirmKeptMaps() {
  const std::vector<StagePlan> plan = Plan();
  for (std::size_t s = 0; s < stages_.size(); ++s) {
    for (std::size_t j = 0; j < jobs_.size() && stages_[s].is_output; ++j) {
      const std::string& key = plan[s].keys[j];
      const int stage = static_cast<int>(s), job = static_cast<int>(j);
      if (!key.empty() && IsDone(stage, job, key)) record_.Confirm({NameOf(job), stages_[s].result});
    }
  }
}

void StereoPipeline::RemoveIntermediateFiles() {
  for (const Stage& stage : stages_) {
    if (stage.is_output) continue;
    for (std::size_t j = 0; j < jobs_.size(); ++j) {
      store_.RemoveFiles(jobs_[j].image, stage.result);
      record_.Forget({NameOf(static_cast<int>(j)), stage.result});
    }
  }
}

void StereoPipeline::Summarize(double seconds) {
  summary_.num_images = static_cast<int>(jobs_.size());
  summary_.seconds = seconds;
  summary_.inference = tasks_.Inference();
  summary_.peak_host_bytes = PeakHostBytes();
  summary_.peak_cache_bytes = store_.cache().peak_bytes();
  summary_.bytes_written = store_.writers().bytes_written();
  summary_.write_seconds = store_.writers().busy_seconds();
  for (const auto& backend : backends_) summary_.devices.push_back(SummarizeDevice(*backend));
}

bool StereoPipeline::WritesCost(int stage) const {
  const bool makes_photometric = stages_[stage].result == kPhotometric;
  return options_.NeedsCost() && (makes_photometric || stages_[stage].kind == StageKind::kEstimate);
}

}  // namespace colmap_ext

#include "colmap_ext/pipeline/hole_filling.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "colmap_ext/pipeline/original_maps.h"
#include "colmap_ext/pipeline/result_key.h"
#include "phi/base/error.h"
#include "phi/base/log.h"
#include "phi/base/utc_time.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kNumWriters = 2;

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

phi::SparseDepth NoSparseDepth(int) { return {}; }  // nothing is estimated here

}  // namespace

HoleFilling::HoleFilling(const Workspace& workspace, std::vector<ImageJob> jobs,
                         const PipelineOptions& options,
                         const std::map<std::string, std::string>& effective_options,
                         const Backends& backends)
    : workspace_(workspace),
      options_(options),
      jobs_(std::move(jobs)),
      backends_(backends),
      record_(workspace.StereoFolder()),
      store_(workspace, options.CacheBytes(), kNumWriters),
      tasks_(workspace_, jobs_, options_, NoSparseDepth, &store_),
      keys_(jobs_.size()) {
  record_.SetOptions(effective_options, record_.options_hash());
}

RunSummary HoleFilling::Run() {
  const Clock::time_point begin = Clock::now();
  summary_.num_images = static_cast<int>(jobs_.size());
  FindMeasuredMaps();
  RunStages(BuildFillingStages(options_));
  if (options_.inference.mode == phi::InferenceMode::kOff) {
    for (const ImageJob& job : jobs_) fs::remove(workspace_.FilledMaskPath(job.image));
  }
  store_.Drain();
  for (std::size_t j = 0; j < jobs_.size(); ++j) store_.RemoveFiles(jobs_[j].image, "inferred");
  Summarize(SecondsSince(begin));
  record_.AddRun(SummaryJson(summary_, phi::UtcNow()));
  record_.Compact();
  return summary_;
}

void HoleFilling::Summarize(double seconds) {
  summary_.seconds = seconds;
  summary_.inference = tasks_.Inference();
  summary_.peak_host_bytes = PeakHostBytes();
  summary_.peak_cache_bytes = store_.cache().peak_bytes();
  summary_.bytes_written = store_.writers().bytes_written();
  summary_.write_seconds = store_.writers().busy_seconds();
  for (const auto& backend : backends_) summary_.devices.push_back(SummarizeDevice(*backend));
}

void HoleFilling::FindMeasuredMaps() {
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    const int job = static_cast<int>(j);
    if (!jobs_[j].problem.empty()) {
      phi::LogWarning(jobs_[j].problem);
    } else if (ImportMeasuredMap(job)) {
      keys_[j] = ResultKey().Add(kMeasured).Add(NameOf(job)).Hex();
    } else if (GeometricMapIsOurs(job)) {
      Fail(job, std::string(kMeasured),
           "image " + NameOf(job) +
               ": its measured maps are missing or damaged, and its geometric ones hold inferred depths "
               "already; run patch_match_stereo, which makes both again");
    } else {
      phi::LogWarning("image " + NameOf(job) + " has no depth and normal maps of its size: left out");
    }
  }
  if (std::all_of(keys_.begin(), keys_.end(), [](const std::string& key) { return key.empty(); })) {
    throw phi::InputError(
        workspace_.StereoFolder().string() +
        " holds no .measured.bin or .geometric.bin maps of the images' size; run patch_match_stereo "
        "first, or give the --PatchMatchStereo.max_image_size that it ran with");
  }
}

// Else it is another program's. The mask tells where phimvs.json was lost.
bool HoleFilling::GeometricMapIsOurs(int job) const {
  const int image = jobs_[job].image;
  const TaskRecord* record = record_.Find(NameOf(job), std::string(kGeometric));
  if (record == nullptr) return fs::exists(workspace_.FilledMaskPath(image));
  return store_.Inspect(image, std::string(kGeometric), false, false, record).foreign.empty();
}

// Of a measured map that nothing is known of: all pixels are as good.
std::shared_ptr<const phi::Mask> HoleFilling::NoMask(int job) const {
  const phi::Pinhole& size = workspace_.views()[jobs_[job].image].camera.pinhole;
  return std::make_shared<const phi::Mask>(size.width, size.height);
}

// Another program's geometric map is newer than any copy of it.
bool HoleFilling::ImportMeasuredMap(int job) {
  const int image = jobs_[job].image;
  const std::string measured(kMeasured), geometric(kGeometric);
  const bool has_measured = store_.MapsAreWhole(image, measured);
  const bool has_foreign = !GeometricMapIsOurs(job) && store_.MapsAreWhole(image, geometric);
  if (!has_foreign) {
    if (has_measured && !store_.HasMask(image, measured)) store_.Save(image, measured, {.mask = NoMask(job)});
    return has_measured;
  }
  if (!options_.overwrite) {
    throw phi::InputError(workspace_.DepthMapPath(image, geometric).string() +
                          " was made by another program, and filling replaces it; add --overwrite true. The "
                          "originals are kept, and --restore true puts them back");
  }
  KeepOriginalMaps(workspace_, image);
  store_.Save(image, measured, {.mask = NoMask(job)});
  return true;
}

void HoleFilling::Fail(int job, const std::string& stage, const std::string& message) {
  phi::LogError(message);
  summary_.failures.push_back({NameOf(job), stage, message});
  keys_[job].clear();
}

// The first one is there already.
void HoleFilling::RunStages(const std::vector<Stage>& stages) {
  std::vector<ProgressStage> progress_stages;
  for (const Stage& stage : stages) {
    progress_stages.push_back({.name = ActivityName(stage.kind), .weight = stage.weight});
  }
  progress_ = std::make_unique<ProgressLine>(std::move(progress_stages));
  const auto has_key = [](const std::string& key) { return !key.empty(); };
  const auto num_images = std::count_if(keys_.begin(), keys_.end(), has_key);
  for (std::size_t s = 1; s < stages.size(); ++s) {
    progress_->SetNumTasks(static_cast<int>(s), static_cast<int>(num_images));
  }
  for (std::size_t s = 1; s < stages.size(); ++s) {
    progress_->BeginStage(static_cast<int>(s));
    RunStage(stages[s], stages[s - 1]);
  }
  progress_.reset();
}

void HoleFilling::RunStage(const Stage& stage, const Stage& previous) {
  std::vector<int> pending;
  std::vector<RunRecord::Task> names;
  std::vector<std::string> keys;
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    if (keys_[j].empty()) continue;
    pending.push_back(static_cast<int>(j));
    names.emplace_back(NameOf(static_cast<int>(j)), stage.result);
    keys.push_back(std::string(kFillingKey) + keys_[j]);
  }
  if (!stage.transient) record_.Begin(names, keys);
  const Clock::time_point begin = Clock::now();
  const auto failures = RunTasks(pending, backends_, [&](int job, phi::Backend& backend) {
    const Clock::time_point task_begin = Clock::now();
    ProgressLine::Task progress(progress_.get());
    TaskRecord record;
    const StageResult result = tasks_.Run(stage, &previous, keys_, job, backend, &progress, &record.warnings);
    for (const std::string& warning : record.warnings) {
      phi::LogWarning("image " + NameOf(job) + ": " + warning);
    }
    record.state = "done";
    record.key = std::string(kFillingKey) + keys_[job];
    record.seconds = SecondsSince(task_begin);
    Save(stage, job, result, record);
  });
  for (const ImageJob& job : jobs_) store_.Forget(job.image, previous.result);
  summary_.stages.push_back({.name = stage.result});
  summary_.stages.back().num_made = static_cast<int>(pending.size() - failures.size());
  summary_.stages.back().seconds = SecondsSince(begin);
  for (const TaskFailure& failure : failures) Fail(failure.task, stage.result, failure.message);
}

void HoleFilling::Save(const Stage& stage, int job, const StageResult& result, const TaskRecord& record) {
  if (stage.transient) {
    store_.KeepTransient(jobs_[job].image, stage.result, result);
    return;
  }
  store_.Write(jobs_[job].image, stage.result, result,
               [this, task = RunRecord::Task(NameOf(job), stage.result),
                record = record](const std::vector<FileIdentity>& files) mutable {
                 record.files = files;
                 record_.Finish(task, record);
               });
}

}  // namespace colmap_ext

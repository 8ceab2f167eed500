#include "colmap_ext/pipeline/hole_filling.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/original_maps.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

phi::SparseDepth NoSparseDepth(int) { return {}; }  // nothing is estimated here

}  // namespace

HoleFilling::HoleFilling(const Workspace& workspace, std::vector<ImageJob> jobs,
                         const PipelineOptions& options,
                         const std::map<std::string, std::string>& effective_options,
                         const Backends& backends)
    : workspace_(workspace),
      options_(options),
      jobs_(std::move(jobs)),
      runner_(workspace_, jobs_, options_, NoSparseDepth, backends),
      has_map_(jobs_.size(), 0) {
  runner_.record().SetOptions(effective_options, runner_.record().options_hash());
}

RunSummary HoleFilling::Run() {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  FindMeasuredMaps();
  RecordImpossibleJobs();
  runner_.Begin(BuildFillingStages(options_));
  for (auto plan = Plan(); HasPending(plan); plan = Plan()) runner_.Run(plan);
  runner_.End();
  for (const ImageJob& job : jobs_) runner_.store().RemoveFiles(job.image, std::string(kInferred));
  runner_.summary().seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  runner_.AddToRecord();
  runner_.record().Compact();
  return runner_.summary();
}

void HoleFilling::FindMeasuredMaps() {
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    const int job = static_cast<int>(j);
    if (jobs_[j].file_is_missing && !options_.allow_missing_files) {
      runner_.Fail(job, std::string(kMeasured), jobs_[j].problem);
    } else if (!jobs_[j].problem.empty()) {
      runner_.LeaveOut(jobs_[j].problem);
    } else if (ImportMeasuredMap(job)) {
      has_map_[j] = 1;
      jobs_[j].keeps_measured = !MapsAreOurs(job, kMeasured);
    } else if (GeometricMapIsOurs(job) && runner_.store().MapsAreWhole(jobs_[j].image, std::string(kGeometric))) {
      runner_.Fail(
          job, std::string(kMeasured),
          "image " + NameOf(job) +
              ": its measured maps are missing, damaged or of another size, and its geometric ones hold "
              "inferred depths already; give the --PatchMatchStereo.max_image_size that "
              "patch_match_stereo ran with, or run that, which makes both again");
    } else if (HasSomeMap(job, kMeasured) || HasSomeMap(job, kGeometric)) {
      runner_.Fail(job, std::string(kMeasured), "image " + NameOf(job) + ": its maps cannot be filled: " + ProblemOfMaps(job));
    } else {
      runner_.LeaveOut("image " + phi::AboutImage(NameOf(job)) + ": left out, it has no maps to fill: " + ProblemOfMaps(job));
    }
  }
  if (const phi::Message problem = DescribeImpossible(jobs_, std::string(kMeasured)); !problem.empty()) throw phi::InputError(problem);
  if (std::count(has_map_.begin(), has_map_.end(), 0) == std::ssize(has_map_)) {
    throw phi::InputError(
        phi::AboutFile(workspace_.StereoFolder()) +
        " holds no .measured.bin or .geometric.bin maps of the images' size; run patch_match_stereo "
        "first, or give the --PatchMatchStereo.max_image_size that it ran with");
  }
}

// For `status`: what the image has is no result of this run.
void HoleFilling::RecordImpossibleJobs() {
  std::vector<RunRecord::Task> tasks;
  std::vector<std::string> why;
  for (const phi::Message& failure : runner_.summary().failures) {
    tasks.emplace_back(failure.image, kGeometric);
    why.push_back(failure.text);
  }
  runner_.record().FailAll(tasks, why);
}

bool HoleFilling::MapsAreOurs(int job, std::string_view kind) const {
  const auto record = runner_.record().Find(NameOf(job), std::string(kind));
  return record && runner_.store().MapsAreOurs(jobs_[job].image, std::string(kind), *record);
}

// Else it is another program's. The mask tells where phimvs.json was lost.
bool HoleFilling::GeometricMapIsOurs(int job) const {
  const bool is_recorded = runner_.record().Find(NameOf(job), std::string(kGeometric)).has_value();
  return is_recorded ? MapsAreOurs(job, kGeometric) : fs::exists(workspace_.FilledMaskPath(jobs_[job].image));
}

// Whole or not.
bool HoleFilling::HasSomeMap(int job, std::string_view kind) const {
  const int image = jobs_[job].image;
  std::error_code unreachable;
  return runner_.store().IsCompact(image, std::string(kind)) || fs::exists(workspace_.DepthMapPath(image, kind), unreachable) ||
         fs::exists(workspace_.NormalMapPath(image, kind), unreachable);
}

// Of those that are there, if only in part.
phi::Message HoleFilling::ProblemOfMaps(int job) const {
  return runner_.store().MapsProblem(jobs_[job].image, std::string(HasSomeMap(job, kMeasured) ? kMeasured : kGeometric));
}

// Of a measured map that nothing is known of: all pixels are as good.
void HoleFilling::SaveNoMarks(int job) const {
  const int image = jobs_[job].image;
  const phi::Pinhole& size = workspace_.views()[image].camera.pinhole;
  runner_.store().SaveStates(image, std::string(kMeasured), phi::StateMap(size.width, size.height));
}

// Another program's geometric map is newer than any copy of it.
bool HoleFilling::ImportMeasuredMap(int job) {
  const int image = jobs_[job].image;
  const std::string measured(kMeasured), geometric(kGeometric);
  const bool has_measured = runner_.store().MapsAreWhole(image, measured);
  const bool has_foreign = !GeometricMapIsOurs(job) && runner_.store().MapsAreWhole(image, geometric);
  if (!has_foreign) {
    if (has_measured && !runner_.store().HasMask(image, measured)) SaveNoMarks(job);
    return has_measured;
  }
  if (!options_.overwrite) {
    throw phi::InputError(phi::AboutFile(workspace_.DepthMapPath(image, geometric)) +
                          " was made by another program, and filling replaces it; add --overwrite true. The "
                          "originals are kept, and --restore true puts them back");
  }
  KeepOriginalMaps(workspace_, image);
  SaveNoMarks(job);
  return true;
}

// The maps that are there stand for the first stage's.
std::vector<StagePlan> HoleFilling::Plan() const {
  return runner_.Plan({.is_done = [](int stage, int, const std::string&) { return stage == 0; },
                       .has_failed = [this](int stage, int job,
                                            const std::string&) { return stage == 0 && has_map_[job] == 0; }},
                      {.own = {}, .first_stage = 1});
}

}  // namespace colmap_ext

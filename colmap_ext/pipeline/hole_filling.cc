#include "colmap_ext/pipeline/hole_filling.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "colmap_ext/pipeline/original_maps.h"
#include "colmap_ext/pipeline/result_key.h"
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
      keys_(jobs_.size()) {
  runner_.record().SetOptions(effective_options, runner_.record().options_hash());
}

RunSummary HoleFilling::Run() {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  FindMeasuredMaps();
  RunStages(BuildFillingStages(options_));
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
  const TaskRecord* record = runner_.record().Find(NameOf(job), std::string(kGeometric));
  if (record == nullptr) return fs::exists(workspace_.FilledMaskPath(image));
  return runner_.store().MapsAreOurs(image, std::string(kGeometric), *record);
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
    throw phi::InputError(workspace_.DepthMapPath(image, geometric).string() +
                          " was made by another program, and filling replaces it; add --overwrite true. The "
                          "originals are kept, and --restore true puts them back");
  }
  KeepOriginalMaps(workspace_, image);
  SaveNoMarks(job);
  return true;
}

void HoleFilling::Fail(int job, const std::string& stage, const std::string& message) {
  runner_.Fail(job, stage, message);
  keys_[job].clear();
}

void HoleFilling::RunStages(const std::vector<Stage>& stages) {
  runner_.Begin(stages);
  for (std::size_t s = 1; s < stages.size(); ++s) {
    const auto num_images = std::count_if(keys_.begin(), keys_.end(), [](const auto& key) { return !key.empty(); });
    runner_.progress().SetNumTasks(static_cast<int>(s), static_cast<int>(num_images));
  }
  for (std::size_t s = 1; s < stages.size(); ++s) {
    std::vector<int> pending;
    std::vector<std::string> result_keys(jobs_.size());
    for (std::size_t j = 0; j < jobs_.size(); ++j) {
      if (keys_[j].empty()) continue;
      pending.push_back(static_cast<int>(j));
      result_keys[j] = std::string(kFillingKey) + keys_[j];
    }
    const StageWork work{.number = static_cast<int>(s),
                         .stage = stages[s],
                         .previous = &stages[s - 1],
                         .input_keys = keys_,
                         .pending = pending,
                         .keys = result_keys};
    for (const JobFailure& failure : runner_.Run({work}).failures) keys_[failure.job].clear();
  }
}

}  // namespace colmap_ext

#include "colmap_ext/pipeline/image_jobs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <set>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "colmap_ext/format_text.h"
#include "colmap_ext/mask_check.h"
#include "colmap_ext/one_place.h"
#include "colmap_ext/patch_match_config.h"
#include "colmap_ext/pinhole_camera.h"
#include "colmap_ext/pipeline/file_identity.h"
#include "colmap_ext/pipeline/result_key.h"
#include "phi/base/error.h"
#include "phi/base/log.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/view_selection.h"

namespace colmap_ext {
namespace {

// Images with fewer pixels on their longest side show too little parallax to select source views.
constexpr int kFewestPixels = 32;

// Changes with the points, their tracks' lengths and the working cameras' number.
std::string SceneKey(const phi::SparseScene& scene) {
  ResultKey key;
  key.Add(static_cast<std::int64_t>(scene.num_views()));
  for (std::size_t i = 0; i < scene.num_points(); ++i) {
    const Eigen::Vector3d& point = scene.point(i);
    key.Add(point.x()).Add(point.y()).Add(point.z()).Add(static_cast<std::int64_t>(scene.track(i).size()));
  }
  return key.Hex();
}

// Raise it with every change of what masks do to maps (see stage_graph.cc): maps of unmasked images are not made again.
constexpr std::int64_t kMaskRevision = 1;

// The same of how photos are moved.
constexpr std::int64_t kCorrectionRevision = 1;

// Camera and image file of a view.
std::string ViewKey(const Workspace& workspace, int image) {
  const phi::SceneView& view = workspace.views()[image];
  const phi::Pinhole& k = view.camera.pinhole;
  ResultKey key;
  key.Add(std::int64_t{view.image_id}).Add(std::int64_t{k.width}).Add(std::int64_t{k.height});
  key.Add(k.fx).Add(k.fy).Add(k.cx).Add(k.cy);
  for (const double value : view.camera.pose.rotation.reshaped()) key.Add(value);
  for (const double value : view.camera.pose.translation) key.Add(value);
  if (const phi::ImageCorrection* correction = workspace.Correction(image); correction != nullptr) {
    key.Add(kCorrectionRevision);
    for (const double value : correction->coefficients.reshaped()) key.Add(value);
  }
  AddFileSample(workspace.ImagePath(image), &key);
  if (const std::filesystem::path mask = workspace.ImageMaskPath(image);
      !mask.empty() && std::filesystem::exists(mask)) {
    key.Add(kMaskRevision);
    AddFileSample(mask, &key);
  }
  return key.Hex();
}

// By image, of those jobs' images and sources.
std::vector<std::string> ViewKeys(const Workspace& workspace, const std::vector<ImageJob>& jobs,
                                  const std::vector<int>& which) {
  std::vector<int> images;
  for (const int job : which) {
    images.push_back(jobs[job].image);
    images.insert(images.end(), jobs[job].sources.begin(), jobs[job].sources.end());
  }
  std::sort(images.begin(), images.end());
  images.erase(std::unique(images.begin(), images.end()), images.end());
  std::vector<std::string> keys(workspace.views().size());
  tbb::parallel_for(std::size_t{0}, images.size(),
                    [&](std::size_t i) { keys[images[i]] = ViewKey(workspace, images[i]); });
  return keys;
}

// Best first, so that matching, which takes kMaxSourceViews at most, takes the best. Views that the selector does not rank
// go last, in the order in which they were named.
std::vector<int> RankSources(const phi::ViewSelector& selector, const std::vector<int>& sources,
                             int reference, int num_views) {
  std::vector<int> place(num_views, num_views);
  int next = 0;
  for (const phi::SourceView& source : selector.Select(reference, num_views)) place[source.view] = next++;
  std::vector<int> ranked = sources;
  std::stable_sort(ranked.begin(), ranked.end(), [&](int a, int b) { return place[a] < place[b]; });
  return ranked;
}

void SelectSources(const Workspace& workspace, const phi::SparseScene& scene,
                   const std::vector<PatchMatchProblem>& problems, const phi::ViewSelectionOptions& options,
                   std::vector<ImageJob>* jobs) {
  const phi::ViewSelector selector(workspace.views(), scene, options);
  const int num_views = static_cast<int>(workspace.views().size());
  std::atomic<int> num_long_lists = 0;
  tbb::parallel_for(std::size_t{0}, problems.size(), [&](std::size_t j) {
    const std::vector<int>& named = problems[j].sources;
    if (named.size() > static_cast<std::size_t>(phi::kMaxSourceViews)) {
      (*jobs)[j].sources = RankSources(selector, named, problems[j].reference, num_views);
      ++num_long_lists;
    }
    const int max_sources = std::min(problems[j].max_automatic_sources, options.NumSelectedViews());
    if (max_sources <= 0) return;
    (*jobs)[j].max_matched = options.num_source_views;
    for (const phi::SourceView& source : selector.Select(problems[j].reference, max_sources)) {
      (*jobs)[j].sources.push_back(source.view);
    }
  });
  if (num_long_lists == 0) return;
  phi::LogWarning("patch-match.cfg names more than " + std::to_string(phi::kMaxSourceViews) +
                  " source images for " + std::to_string(num_long_lists) + " images: matching takes the " +
                  std::to_string(phi::kMaxSourceViews) + " best of them, the consistency filters take all");
}

void WarnOfMasks(const Workspace& workspace, const std::vector<ImageJob>& jobs) {
  std::vector<int> images;
  for (const ImageJob& job : jobs) images.push_back(job.image);
  for (const auto describe : {DescribeMissingMasks, DescribeTransparentMasks}) {
    const std::string warning = describe(workspace, workspace.mask_path(), images);
    if (!warning.empty()) phi::LogWarning(warning);
  }
}

phi::Message ProblemOf(const Workspace& workspace, const ImageJob& job, phi::Formulas formulas) {
  const phi::Message image = "image " + phi::AboutImage(workspace.views()[job.image].name);
  if (job.file_is_missing) {
    return image + ": the file " + phi::AboutFile(workspace.ImagePath(job.image)) +
           " is missing or cannot be reached";
  }
  if (!job.sources.empty()) return "";
  if (workspace.views().size() == 1) {
    return image + ": it is the only image of the sparse model, and stereo needs at least two";
  }
  const phi::Pinhole& working = workspace.views()[job.image].camera.pinhole;
  const int longest = std::max(working.width, working.height);
  if (longest < kFewestPixels) {
    return image + ": at " + SizeText(working.width, working.height) +
           " pixels no other image sees the scene from another side; raise --PatchMatchStereo.max_image_size";
  }
  if (formulas == phi::Formulas::kPaper) {
    return image +
           ": the paper's Eq. 2 and 3 leave it no source image; they are for images about 3000 pixels wide: "
           "lower "
           "--PhiStereo.min_displacement for smaller ones, or name source images in patch-match.cfg";
  }
  const std::string remedy = workspace.IsInMemory()
                                 ? "leave it out, or name its source images"
                                 : "remove it from patch-match.cfg, or name its source images there";
  return image + ": no other image sees the same part of the scene from another place; " + remedy;
}

// Views from the reference's own place confirm whatever it finds. In the paper's form the lists are taken as they are.
void LeaveOutOwnPlace(const Workspace& workspace, phi::Formulas formulas, std::vector<PatchMatchProblem>* problems) {
  const bool has_lists = std::any_of(problems->begin(), problems->end(), [](const auto& p) { return !p.sources.empty(); });
  if (!has_lists || formulas == phi::Formulas::kPaper) return;
  const OnePlace one_place(workspace);
  std::size_t num_left_out = 0;
  std::string example;
  for (PatchMatchProblem& problem : *problems) {
    const auto stands_there = [&](int source) { return one_place.StandTogether(problem.reference, source); };
    const auto first = std::find_if(problem.sources.begin(), problem.sources.end(), stands_there);
    if (first == problem.sources.end()) continue;
    if (example.empty()) {
      const auto name = [&](int image) { return "'" + workspace.views()[image].name + "'"; };
      example = name(*first) + " of " + name(problem.reference) + " the first";
    }
    num_left_out += std::erase_if(problem.sources, stands_there);
  }
  if (num_left_out == 0) return;
  phi::LogWarning(std::to_string(num_left_out) + " source images that are named stand where their reference image does, " + example +
                  ": they tell no depth and are left out");
}

std::vector<ImageJob> JobsOf(const std::vector<PatchMatchProblem>& problems) {
  std::vector<ImageJob> jobs(problems.size());
  for (std::size_t j = 0; j < problems.size(); ++j) {
    jobs[j].image = problems[j].reference;
    jobs[j].sources = problems[j].sources;
  }
  return jobs;
}

void FindSourceJobs(const Workspace& workspace, std::vector<ImageJob>* jobs) {
  std::vector<int> job_of_image(workspace.views().size(), -1);
  for (std::size_t j = 0; j < jobs->size(); ++j) job_of_image[(*jobs)[j].image] = static_cast<int>(j);
  for (ImageJob& job : *jobs) {
    for (const int source : job.sources) job.source_jobs.push_back(job_of_image[source]);
  }
}

}  // namespace

phi::SparseScene MakeSparseScene(const SparseModel& model) {
  std::unordered_map<std::uint32_t, int> view_of_image;
  std::vector<phi::Pinhole> pinholes;
  for (const SparseImage& image : model.images) {
    view_of_image.emplace(image.image_id, static_cast<int>(pinholes.size()));
    pinholes.push_back(MakePinhole(model.cameras.at(image.camera_id)));
  }
  phi::SparseScene scene(std::move(pinholes));
  std::vector<phi::PointObservation> track;
  for (const SparsePoint& point : model.points) {
    track.clear();
    for (const TrackElement& element : point.track) {
      const auto view = view_of_image.find(element.image_id);
      if (view == view_of_image.end()) continue;
      const auto& observations = model.images[view->second].observations;
      if (element.observation_index >= observations.size()) continue;
      const Observation& seen = observations[element.observation_index];
      track.push_back({view->second, static_cast<float>(seen.x), static_cast<float>(seen.y)});
    }
    scene.AddPoint(point.xyz, track);
  }
  return scene;
}

std::string DescribeJobs(const Workspace& workspace, const std::vector<ImageJob>& jobs) {
  std::set<std::pair<int, int>> sizes;
  std::set<std::size_t> num_sources, num_matched;
  for (const ImageJob& job : jobs) {
    const phi::Pinhole& size = workspace.views()[job.image].camera.pinhole;
    sizes.emplace(size.width, size.height);
    num_sources.insert(job.sources.size());
    num_matched.insert(job.NumMatched());
  }
  std::string text = std::to_string(jobs.size()) + (jobs.size() == 1 ? " image, " : " images, ");
  text += SizeText(sizes.begin()->first, sizes.begin()->second);
  if (sizes.size() > 1) text += " to " + SizeText(sizes.rbegin()->first, sizes.rbegin()->second);
  const auto count_text = [](const std::set<std::size_t>& counts) {
    std::string range = std::to_string(*counts.begin());
    if (counts.size() > 1) range += " to " + std::to_string(*counts.rbegin());
    return range;
  };
  text += ", " + count_text(num_matched) + " source views each";
  if (num_sources != num_matched) text += " (" + count_text(num_sources) + " with witnesses)";
  return text;
}

std::vector<ImageJob> ListImageJobs(const Workspace& workspace, const phi::SparseScene& scene,
                                    const std::filesystem::path& config_path,
                                    const phi::ViewSelectionOptions& options) {
  std::vector<PatchMatchProblem> problems = ReadPatchMatchConfig(workspace, config_path);
  if (problems.empty()) throw phi::InputError("patch-match.cfg names no image; nothing to do");
  LeaveOutOwnPlace(workspace, options.method.formulas, &problems);
  std::vector<ImageJob> jobs = JobsOf(problems);
  WarnOfMasks(workspace, jobs);
  SelectSources(workspace, scene, problems, options, &jobs);
  FindSourceJobs(workspace, &jobs);
  return jobs;
}

void AddInputs(const Workspace& workspace, const phi::SparseScene& scene, phi::Formulas formulas,
               const std::vector<int>& which, std::vector<ImageJob>* jobs) {
  const std::string scene_key = SceneKey(scene);
  const std::vector<std::string> view_keys = ViewKeys(workspace, *jobs, which);
  for (const int index : which) {
    ImageJob& job = (*jobs)[index];
    ResultKey key;
    key.Add(scene_key).Add(view_keys[job.image]);
    for (std::size_t i = 0; i < job.NumMatched(); ++i) key.Add(view_keys[job.sources[i]]);
    job.input_key = key.Hex();
    ResultKey witnesses;
    for (std::size_t i = job.NumMatched(); i < job.sources.size(); ++i) witnesses.Add(view_keys[job.sources[i]]);
    job.witness_key = witnesses.Hex();
    std::error_code unreachable;  // one image's fault, as if there were none
    job.file_is_missing = !std::filesystem::exists(workspace.ImagePath(job.image), unreachable);
    job.problem = ProblemOf(workspace, job, formulas);
  }
}

phi::Message DescribeImpossible(const std::vector<ImageJob>& jobs, const std::string& stage) {
  const auto is_possible = [](const ImageJob& job) { return job.problem.empty(); };
  if (std::any_of(jobs.begin(), jobs.end(), is_possible)) return "";
  return "no image can be done: " + WithContext(jobs.front().problem, phi::AboutStage(stage));
}

std::vector<ImageJob> MakeImageJobs(const Workspace& workspace, const phi::SparseScene& scene,
                                    const std::filesystem::path& config_path,
                                    const phi::ViewSelectionOptions& options) {
  std::vector<ImageJob> jobs = ListImageJobs(workspace, scene, config_path, options);
  std::vector<int> all(jobs.size());
  std::iota(all.begin(), all.end(), 0);
  AddInputs(workspace, scene, options.method.formulas, all, &jobs);
  return jobs;
}

std::vector<ImageJob> MakeMemoryJobs(const Workspace& workspace, const phi::SparseScene& scene,
                                     const std::vector<std::vector<int>>& sources,
                                     const phi::ViewSelectionOptions& options) {
  std::vector<PatchMatchProblem> problems(workspace.views().size());
  for (std::size_t i = 0; i < problems.size(); ++i) {
    problems[i].reference = static_cast<int>(i);
    if (i < sources.size()) problems[i].sources = sources[i];
    problems[i].max_automatic_sources = problems[i].sources.empty() ? options.NumSelectedViews() : 0;
  }
  LeaveOutOwnPlace(workspace, options.method.formulas, &problems);
  std::vector<ImageJob> jobs = JobsOf(problems);
  SelectSources(workspace, scene, problems, options, &jobs);
  FindSourceJobs(workspace, &jobs);
  for (ImageJob& job : jobs) job.problem = ProblemOf(workspace, job, options.method.formulas);
  return jobs;
}

}  // namespace colmap_ext

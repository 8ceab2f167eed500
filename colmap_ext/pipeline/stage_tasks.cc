#include "colmap_ext/pipeline/stage_tasks.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

#include "colmap_ext/compact_codes.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/base/image_noise.h"
#include "phi/base/whole_array.h"
#include "phi/filtering/judge_measurements.h"
#include "phi/inference/infer_holes.h"
#include "phi/inference/region_pixels.h"
#include "phi/inference/region_planes.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/matching/estimation_setup.h"

namespace colmap_ext {
namespace {

// Positions in job.sources: to and fro through the scene from image to image, so that what one filter read last the next
// one reads first. In one and the same order a long list's maps would each have left memory when their turn comes again.
std::vector<std::size_t> FilterOrder(const ImageJob& job) {
  std::vector<std::size_t> order(job.sources.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return job.sources[a] < job.sources[b]; });
  if (job.image % 2 == 1) std::reverse(order.begin(), order.end());
  return order;
}

std::int64_t CountState(const phi::MeasurementMap& map, phi::PixelState state) {
  return phi::CountIf(map.states, [state](phi::PixelState s) { return s == state; });
}

// The map that the stage makes, as its readers get it.
std::shared_ptr<const phi::MeasurementMap> Shared(const Stage& stage, phi::MeasurementMap map) {
  if (stage.is_rounded) map = RoundToCompact(std::move(map));
  return std::make_shared<const phi::MeasurementMap>(std::move(map));
}

StageResult Published(std::shared_ptr<const phi::MeasurementMap> map) {
  if (map->states.empty()) return {.map = std::move(map)};
  return {.map = std::make_shared<const phi::MeasurementMap>(
              phi::MeasurementMap{phi::PublishedPlanes(*map), {}})};
}

}  // namespace

StageTasks::StageTasks(const Workspace& workspace, const std::vector<ImageJob>& jobs,
                       const PipelineOptions& options, SparseDepthFunction sparse_depth, MapStore* store)
    : workspace_(workspace),
      jobs_(jobs),
      options_(options),
      sparse_depth_(std::move(sparse_depth)),
      store_(*store) {}

StageResult StageTasks::Run(const StageTask& task, phi::Backend& backend, ProgressLine::Task* progress,
                            std::vector<phi::Message>* unread) const {
  switch (task.stage.kind) {
    case StageKind::kEstimate:
      return Estimate(task, backend, progress, unread);
    case StageKind::kShare:
      return Share(task, backend);
    case StageKind::kFilter:
      return Filter(task, backend);
    case StageKind::kInfer:
      return Infer(task, backend, unread);
    case StageKind::kPublish:
      return Published(store_.Map(task.job.image, task.previous->result));
  }
  return {};
}

phi::EstimationInput StageTasks::EstimationInputOf(const ImageJob& job, std::vector<int>* used,
                                                   std::vector<phi::Message>* unread) const {
  phi::EstimationInput input;
  // Samples count by their grey level: those of the reference's mask must differ. Those of a source's must not, since
  // only the reference decides which samples of a window count, and an edge that is not there would outweigh the rest.
  const bool has_weights = options_.stereo.method.formulas != phi::Formulas::kPaper;
  input.reference = {&workspace_.views()[job.image],
                     has_weights ? store_.CutGray(job.image) : store_.Gray(job.image)};
  input.noise = NoiseOf(job.image);
  input.sources = ReadSources(job, job.NumMatched(), used, unread);
  if (input.sources.empty()) {
    const phi::Message none = "image " + phi::AboutImage(input.reference.view->name) + ": none of its source images can be read";
    throw phi::InputError(unread->empty() ? none : none + ": " + unread->front());
  }
  phi::SparseDepth sparse = sparse_depth_(job.image);
  input.sparse = std::move(sparse.points);
  const phi::DepthRange range = SearchRange(sparse);
  input.depth_min = range.min;
  input.depth_max = range.max;
  input.depth_range_is_given = options_.GivesDepthRange();
  return input;
}

StageResult StageTasks::Estimate(const StageTask& task, phi::Backend& backend, ProgressLine::Task* progress,
                                 std::vector<phi::Message>* unread) const {
  std::vector<int> used;
  phi::EstimationInput input = EstimationInputOf(task.job, &used, unread);
  input.tell_progress = [progress](double share) { progress->SetShare(share); };
  phi::EstimationResult estimate = backend.Estimate(input, options_.stereo);
  if (const auto mask = store_.ImageMask(task.job.image); mask != nullptr) phi::DropMasked(*mask, &estimate.map);
  StageResult result;
  result.map = Shared(task.stage, {std::move(estimate.map), {}});
  if (options_.NeedsCost()) result.cost = std::make_shared<const phi::CostMap>(std::move(estimate.cost));
  return result;
}

StageResult StageTasks::Share(const StageTask& task, phi::Backend& backend) const {
  const ImageJob& job = task.job;
  const std::string& kind = task.previous->result;
  std::vector<int> used;
  std::vector<phi::Message> unread;  // as in the estimation, which told
  phi::SharingInput input;
  input.estimation = EstimationInputOf(job, &used, &unread);
  input.own = {&workspace_.views()[job.image], store_.Map(job.image, kind)};
  for (const int i : used) {
    if (!task.HasSourceMap(i)) continue;
    input.sources.push_back({&workspace_.views()[job.sources[i]],
                             [this, image = job.sources[i], &kind] { return store_.Map(image, kind); }});
  }
  // Its cost map stays the estimation's: a plane that was taken costs less than that says.
  return {.map = backend.Share(input, options_.stereo)};
}

StageResult StageTasks::Filter(const StageTask& task, phi::Backend& backend) const {
  const Stage &stage = task.stage, &previous = *task.previous;
  const ImageJob& job = task.job;
  phi::FilterInput input;
  input.reference = {&workspace_.views()[job.image], store_.Map(job.image, previous.result)};
  for (const std::size_t i : FilterOrder(job)) {
    phi::SourceMap source{&workspace_.views()[job.sources[i]]};
    if (task.HasSourceMap(i)) {
      source.load = [this, image = job.sources[i], &previous] { return store_.Map(image, previous.result); };
      if (store_.HasImageMask(job.sources[i]))
        source.load_mask = [this, image = job.sources[i]] { return store_.ImageMask(image); };
    }
    input.sources.push_back(std::move(source));
  }
  // Only estimates have one, and are asked: not what inference filled, nor another program's maps.
  if (options_.filter.UsesCost() && previous.kind != StageKind::kInfer) input.cost = store_.Cost(job.image, EstimateKind(options_));
  if (stage.judges_measurements) {
    const float farthest = phi::FarthestSearched(SearchRange(sparse_depth_(job.image)).max, options_.GivesDepthRange(),
                                                 options_.stereo.method);
    input.judgement = {store_.Gray(job.image), NoiseOf(job.image), PrecisionOf(job), farthest, options_.filter.method.rules};
  }
  phi::MeasurementMap filtered = backend.Filter(input, options_.filter);
  if (stage.restores_measured && !job.keeps_measured) {
    phi::RestoreMeasured(*store_.Map(job.image, std::string(kMeasured)), input.reference.map->states,
                         options_.filter.min_num_consistent_inferred, &filtered);
  }
  if (previous.kind == StageKind::kInfer) {
    const std::int64_t num_kept =
        phi::CountIf(filtered.states, [](phi::PixelState s) { return phi::IsInferred(s); });
    std::lock_guard<std::mutex> lock(mutex_);
    inference_.num_kept += num_kept;
  }
  if (!stage.has_mask) filtered.states = {};
  StageResult result;
  result.map = Shared(stage, std::move(filtered));
  // The filtered photometric map takes the raw one's place, and its cost goes with it.
  if (stage.result == kPhotometric && options_.NeedsCost()) {
    result.cost = store_.Cost(job.image, EstimateKind(options_));
  }
  return result;
}

double StageTasks::NoiseOf(int image) const {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (const auto found = noise_.find(image); found != noise_.end()) return found->second;
  }
  const double noise = phi::NoiseDeviation(store_.CutGray(image)->view());
  std::lock_guard<std::mutex> lock(mutex_);
  return noise_.emplace(image, noise).first->second;
}

phi::DepthRange StageTasks::SearchRange(const phi::SparseDepth& sparse) const {
  if (!options_.GivesDepthRange()) return sparse.range;
  return {static_cast<float>(options_.depth_min), static_cast<float>(options_.depth_max)};
}

phi::DepthPrecision StageTasks::PrecisionOf(const ImageJob& job) const {
  std::vector<const phi::Camera*> sources;
  for (std::size_t i = 0; i < job.NumMatched(); ++i)
    sources.push_back(&workspace_.views()[job.sources[i]].camera);
  return phi::DepthPrecision(workspace_.views()[job.image].camera, sources);
}

void StageTasks::PrepareInference(int job) const noexcept {
  try {
    if (AsksRegions()) store_.Regions(jobs_[job].image, options_.inference.method.rules);
  } catch (...) {
    // inference meets it again
  }
}

phi::InferenceInput StageTasks::InferenceInputOf(const StageTask& task, std::vector<int>* used,
                                                 std::vector<phi::Message>* unread) const {
  const ImageJob& job = task.job;
  phi::InferenceInput input;
  input.reference = ReadView(job.image);
  input.sources = ReadSources(job, std::min<std::size_t>(job.sources.size(), phi::kMaxSourceViews), used, unread);
  input.max_matched = static_cast<int>(std::count_if(
      used->begin(), used->end(), [&](int i) { return static_cast<std::size_t>(i) < job.NumMatched(); }));
  input.mask = store_.ImageMask(job.image);
  input.measured = store_.Map(job.image, task.previous->result);
  input.source_depths = SourceDepths(task, *used);
  input.source_regions = SourceRegions(job, *used, input);
  if (AsksRegions()) input.regions = store_.Regions(job.image, options_.inference.method.rules);
  input.keeps_measured = job.keeps_measured;
  if (options_.GivesDepthRange()) {
    input.nearest = static_cast<float>(options_.depth_min);
    input.farthest = static_cast<float>(options_.depth_max);
  }
  return input;
}

StageResult StageTasks::Infer(const StageTask& task, phi::Backend& backend, std::vector<phi::Message>* unread) const {
  // First what other images are read for, so that no more of them is in memory at once.
  Choices choices;
  backend.RunOnHost([&] { choices = ChoicesAround(task); });
  std::vector<int> used;
  phi::InferenceInput input = InferenceInputOf(task, &used, unread);
  input.choice = choices.own;
  if (choices.own != nullptr) {
    for (const int i : used) input.source_choices.push_back(choices.of_sources[i]);
  }
  phi::InferenceResult inferred = phi::InferHoles(backend, input, options_.stereo, options_.inference);
  CountInference(*input.measured, input.mask.get(), inferred);
  return {.map = std::make_shared<const phi::MeasurementMap>(std::move(inferred.map))};
}

void StageTasks::CountInference(const phi::MeasurementMap& measured, const phi::ImageMask* mask,
                                const phi::InferenceResult& inferred) const {
  std::int64_t num_holes =
      phi::CountIf(measured.states, [](phi::PixelState s) { return !phi::IsMeasured(s); });
  if (mask != nullptr) num_holes -= phi::CountIf(*mask, [](std::uint8_t v) { return v == 0; });
  const std::int64_t num_confirmed = CountState(inferred.map, phi::PixelState::kInferredConfirmed);
  const std::int64_t num_alone = CountState(inferred.map, phi::PixelState::kInferredAlone);
  const phi::FieldStatistics& one = inferred.statistics;
  std::lock_guard<std::mutex> lock(mutex_);
  inference_.num_holes += num_holes;
  inference_.num_confirmed += num_confirmed;
  inference_.num_alone += num_alone;
  phi::FieldStatistics& sum = inference_.field;
  sum.num_nodes += one.num_nodes;
  sum.energy += one.energy;
  sum.lower_bound += one.lower_bound;
  sum.min_cost_energy += one.min_cost_energy;
  sum.num_unlike_min_cost += one.num_unlike_min_cost;
  sum.num_without_hypothesis += one.num_without_hypothesis;
}

InferenceSummary StageTasks::Inference() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return inference_;
}

phi::ViewImage StageTasks::ReadView(int image) const {
  return {&workspace_.views()[image], store_.Gray(image)};
}

std::vector<phi::ViewImage> StageTasks::ReadSources(const ImageJob& job, std::size_t num_sources,
                                                    std::vector<int>* used,
                                                    std::vector<phi::Message>* unread) const {
  std::vector<phi::ViewImage> sources;
  for (std::size_t i = 0; i < num_sources; ++i) {
    try {
      sources.push_back(ReadView(job.sources[i]));
      used->push_back(static_cast<int>(i));
    } catch (const phi::InputError& error) {
      unread->push_back(WithContext(error.message(), phi::AboutImage(workspace_.views()[job.sources[i]].name)));
    }
  }
  return sources;
}

std::vector<std::shared_ptr<const phi::MeasuredDepths>> StageTasks::SourceDepths(const StageTask& task,
                                                                                 const std::vector<int>& used) const {
  std::vector<std::shared_ptr<const phi::MeasuredDepths>> depths;
  for (const int i : used) {
    depths.push_back(task.HasSourceMap(i) ? store_.Depths(task.job.sources[i], task.previous->result) : nullptr);
  }
  return depths;
}

bool StageTasks::AsksRegions() const {
  return options_.inference.mode != phi::InferenceMode::kOff &&
         options_.inference.method.formulas == phi::Formulas::kRobust;
}

std::vector<std::shared_ptr<const phi::ViewRegions>> StageTasks::SourceRegions(
    const ImageJob& job, const std::vector<int>& used, const phi::InferenceInput& input) const {
  std::vector<std::shared_ptr<const phi::ViewRegions>> regions;
  const phi::InferenceOptions& options = options_.inference;
  if (!AsksRegions() || !options.method.rules.IsOn(phi::Rule::kSourceRegions)) return regions;
  regions.resize(used.size());
  tbb::parallel_for(std::size_t{0}, used.size(), [&](std::size_t i) {
    const std::shared_ptr<const phi::MeasuredDepths>& depths = input.source_depths[i];
    if (depths == nullptr) return;  // another image that makes no map has none
    const ImageJob& source = jobs_[job.source_jobs[used[i]]];
    regions[i] = store_.ToldRegions(source.image, [&] {
      return phi::FindViewRegions(store_.Regions(source.image, options.method.rules), *depths,
                                  workspace_.views()[source.image].image_id, PrecisionOf(source),
                                  options.method.rules);
    });
  });
  return regions;
}

StageTasks::Choices StageTasks::ChoicesAround(const StageTask& task) const {
  Choices choices;
  if (!task.stage.reads_maps_around_sources) return choices;
  choices.own = Choice(task);
  choices.of_sources.resize(task.job.sources.size());
  const std::size_t num_asked = std::min<std::size_t>(task.job.sources.size(), phi::kMaxSourceViews);
  for (std::size_t k = 0; k < num_asked; ++k) {
    // Images whose turn it is at once have many of them in common, and should not wait for each other's.
    const std::size_t i = (static_cast<std::size_t>(task.job.image) + k) % num_asked;
    if (!task.HasSourceMap(i)) continue;
    try {
      choices.of_sources[i] = Choice({task.stage, task.previous, task.input_keys, jobs_[task.job.source_jobs[i]]});
    } catch (const phi::InputError&) {
      // its own inference tells, and this image goes without
    }
  }
  return choices;
}

std::shared_ptr<const phi::ViewChoice> StageTasks::Choice(const StageTask& task) const {
  return store_.Choice(task.job.image, [&] {
    phi::ThrowIfCancelled();
    std::vector<int> used;
    std::vector<phi::Message> unread;  // the image's own inference tells
    return phi::ChooseRegionPlanes(InferenceInputOf(task, &used, &unread), options_.inference.method.rules);
  });
}

}  // namespace colmap_ext

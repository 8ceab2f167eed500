// What a stage does for one image: collect the inputs, call the backend, hand back the result.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/map_store.h"
#include "colmap_ext/pipeline/run_summary.h"
#include "colmap_ext/pipeline/stage_plan.h"
#include "colmap_ext/progress.h"
#include "phi/geometry/depth_precision.h"
#include "phi/inference/source_regions.h"
#include "phi/inference/view_choice.h"
#include "phi/sparse_depth.h"

namespace colmap_ext {

// The reliable sparse points and the depth range of a view. Called from several threads at once.
using SparseDepthFunction = std::function<phi::SparseDepth(int image)>;

// An image's turn at a stage.
struct StageTask {
  const Stage& stage;
  const Stage* previous;                       // whose maps it reads; null: it is the first stage, and reads none
  const std::vector<std::string>& input_keys;  // by job, empty where the stage before made no map
  const ImageJob& job;

  // Whether the stage before made a map of the image's source `i`.
  bool HasSourceMap(std::size_t i) const { return job.source_jobs[i] >= 0 && !input_keys[job.source_jobs[i]].empty(); }
};

// Thread-safe. References must outlive it.
class StageTasks {
 public:
  StageTasks(const Workspace& workspace, const std::vector<ImageJob>& jobs, const PipelineOptions& options,
             SparseDepthFunction sparse_depth, MapStore* store);

  // `progress` gets how far this image is, `unread` why source images cannot be read, which are left out; both may not be null. Throws
  // phi::InputError when this image cannot be done.
  StageResult Run(const StageTask& task, phi::Backend& backend, ProgressLine::Task* progress, std::vector<phi::Message>* unread) const;

  // What inference will ask of the image alone, so that it is there by then. What fails here fails there, and is told there.
  void PrepareInference(int job) const noexcept;

  // Of the images that Run has done so far.
  InferenceSummary Inference() const;

 private:
  StageResult Estimate(const StageTask& task, phi::Backend& backend, ProgressLine::Task* progress,
                       std::vector<phi::Message>* unread) const;
  StageResult Share(const StageTask& task, phi::Backend& backend) const;
  // What the estimation reads, and its sources' positions in job.sources.
  phi::EstimationInput EstimationInputOf(const ImageJob& job, std::vector<int>* used,
                                         std::vector<phi::Message>* unread) const;
  StageResult Filter(const StageTask& task, phi::Backend& backend) const;
  // NoiseDeviation of the image, which several stages ask for.
  double NoiseOf(int image) const;
  // Its depths, in place of which the user's count.
  phi::DepthRange SearchRange(const phi::SparseDepth& sparse) const;
  phi::DepthPrecision PrecisionOf(const ImageJob& job) const;
  StageResult Infer(const StageTask& task, phi::Backend& backend, std::vector<phi::Message>* unread) const;
  // But for what the sources' regions chose. `used` as ReadSources.
  phi::InferenceInput InferenceInputOf(const StageTask& task, std::vector<int>* used, std::vector<phi::Message>* unread) const;
  // mask: of the image, may be null.
  void CountInference(const phi::MeasurementMap& measured, const phi::ImageMask* mask,
                      const phi::InferenceResult& inferred) const;
  phi::ViewImage ReadView(int image) const;
  // Of the first `num_sources` sources those whose image can be read. `used` gets their positions in job.sources.
  std::vector<phi::ViewImage> ReadSources(const ImageJob& job, std::size_t num_sources,
                                          std::vector<int>* used, std::vector<phi::Message>* unread) const;
  // Of the stage before, of the sources at positions `used` of job.sources; null where there are none.
  std::vector<std::shared_ptr<const phi::MeasuredDepths>> SourceDepths(const StageTask& task,
                                                                       const std::vector<int>& used) const;

  // Whether inference looks at the images' regions.
  bool AsksRegions() const;
  // Parallel to input.sources; empty where the rule is off.
  std::vector<std::shared_ptr<const phi::ViewRegions>> SourceRegions(const ImageJob& job,
                                                                     const std::vector<int>& used,
                                                                     const phi::InferenceInput& input) const;
  // What the image's regions choose first, and its sources' (parallel to job.sources; null where the stage before made no map).
  struct Choices {
    std::shared_ptr<const phi::ViewChoice> own;  // null: regions choose once
    std::vector<std::shared_ptr<const phi::ViewChoice>> of_sources;
  };
  Choices ChoicesAround(const StageTask& task) const;
  std::shared_ptr<const phi::ViewChoice> Choice(const StageTask& task) const;

  const Workspace& workspace_;
  const std::vector<ImageJob>& jobs_;
  const PipelineOptions& options_;
  SparseDepthFunction sparse_depth_;
  MapStore& store_;
  mutable std::mutex mutex_;
  mutable std::map<int, double> noise_;  // by image, of those asked for so far
  mutable InferenceSummary inference_;
};

}  // namespace colmap_ext

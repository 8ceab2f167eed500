#include "colmap_ext/pipeline/memory_scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <mutex>
#include <system_error>
#include <utility>

#include "colmap_ext/fusion/fusion_map_reader.h"
#include "colmap_ext/map_shape.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/stage_loop.h"
#include "phi/base/error.h"
#include "phi/base/log.h"
#include "phi/base/whole_array.h"
#include "phi/sparse_depth.h"

namespace colmap_ext {
namespace {

constexpr std::int64_t kNoLimit = std::numeric_limits<std::int64_t>::max();

std::shared_ptr<const phi::Mask> InferredMask(const phi::MeasurementMap& map) {
  return std::make_shared<const phi::Mask>(phi::Transformed(
      map.states, [](phi::PixelState s) { return static_cast<std::uint8_t>(phi::IsInferred(s) ? 255 : 0); }));
}

// Maps that are given stay as they are.
std::vector<ImageJob> MakeJobs(const Workspace& workspace, const phi::SparseScene& scene,
                               const std::vector<std::vector<int>>& sources, const phi::ViewSelectionOptions& options,
                               bool maps_are_given) {
  std::vector<ImageJob> jobs = MakeMemoryJobs(workspace, scene, sources, options);
  for (ImageJob& job : jobs) job.keeps_measured = maps_are_given;
  return jobs;
}

// One run through the stages.
class MemoryRun {
 public:
  MemoryRun(const Workspace& workspace, const std::vector<std::vector<int>>& sources, const PipelineOptions& options,
            const Backends& backends, std::vector<Stage> stages)
      : workspace_(workspace),
        stages_(std::move(stages)),
        scene_(MakeSparseScene(workspace.model())),
        sparse_depth_(workspace.views(), scene_, options.stereo.method.rules),
        jobs_(MakeJobs(workspace, scene_, sources, options.view_selection, stages_.front().kind != StageKind::kEstimate)),
        options_(options),
        loop_(workspace, jobs_, options_, [this](int image) { return sparse_depth_.ForView(image); }, backends,
              kNoLimit),
        maps_(jobs_.size()) {
    for (std::size_t j = 0; j < jobs_.size(); ++j) {
      if (!jobs_[j].problem.empty()) Fail(0, static_cast<int>(j), jobs_[j].problem);
    }
  }

  // Of the stage before the first that Run does.
  void SetMap(int job, const std::string& kind, const StageResult& result) { loop_.store().KeepInMemory(job, kind, result); }

  std::vector<SceneMaps> Run(int first_stage) {
    const auto plan_rest = [&] {
      return loop_.Plan({.is_done = [&](int stage, int, const std::string&) { return stage < first_stage; },
                         .has_failed = [](int, int, const std::string&) { return false; }},
                        {.own = {}, .first_stage = first_stage});
    };
    const auto keep = [this](int stage, int job, const TaskOutcome& outcome) {
      Keep(stage, job, outcome.result);
    };
    loop_.Begin(stages_);
    const auto fail = [this](const JobFailure& failure) { Fail(failure.stage, failure.job, failure.message); };
    for (auto plan = plan_rest(); HasPending(plan); plan = plan_rest()) loop_.Run(plan, static_cast<int>(plan.size()), keep, fail);
    loop_.End();
    Finish();
    return std::move(maps_);
  }

 private:
  // An image's stages come one after the other.
  void Keep(int stage, int job, const StageResult& result) {
    loop_.store().KeepInMemory(jobs_[job].image, stages_[stage].result, result);
    std::lock_guard<std::mutex> lock(mutex_);
    maps_[job].map = phi::PlanesOf(result.map);
    if (stages_[stage].kind == StageKind::kEstimate) maps_[job].cost = result.cost;
    const bool after_inference = stage > 0 && stages_[stage - 1].kind == StageKind::kInfer;
    maps_[job].inferred = after_inference ? InferredMask(*result.map) : nullptr;
  }

  void Fail(int stage, int job, const phi::Message& message) {
    const phi::Message context = phi::AboutImage(workspace_.views()[jobs_[job].image].name) + phi::AboutStage(stages_[stage].result);
    const phi::Message problem = WithContext(message, context);
    phi::LogError(problem);
    std::lock_guard<std::mutex> lock(mutex_);
    maps_[job] = {};
    maps_[job].problem = problem;
  }

  void Finish() {
    const auto has_failed = [](const SceneMaps& maps) { return !maps.problem.empty(); };
    if (std::all_of(maps_.begin(), maps_.end(), has_failed)) throw phi::InputError(maps_.front().problem);
    for (std::size_t j = 0; j < maps_.size(); ++j) {
      const phi::Pinhole& size = workspace_.views()[j].camera.pinhole;
      if (maps_[j].map == nullptr) maps_[j].map = std::make_shared<const phi::PlaneMap>(size.width, size.height);
    }
  }

  const Workspace& workspace_;
  const std::vector<Stage> stages_;
  const phi::SparseScene scene_;
  const phi::SparseDepthSource sparse_depth_;
  const std::vector<ImageJob> jobs_;  // of view j
  const PipelineOptions options_;
  StageLoop loop_;
  std::mutex mutex_;  // guards maps_ while tasks run
  std::vector<SceneMaps> maps_;
};

class MemoryMaps final : public FusionMapSource {
 public:
  MemoryMaps(const Workspace& workspace, const std::vector<SceneMaps>& maps) : workspace_(workspace), maps_(maps) {}

  bool Exists(int image) const override { return maps_[image].map != nullptr; }
  bool HasMask(int image) const override { return workspace_.HasImageMask(image); }

  phi::Camera ReadCamera(int image) const override {
    phi::Camera camera = workspace_.views()[image].camera;
    const phi::PlaneMap& map = *maps_[image].map;
    camera.pinhole = CameraOfMap(camera.pinhole, map.width(), map.height(), "image " + phi::AboutImage(workspace_.views()[image].name));
    return camera;
  }

  phi::FusionMap Read(int image) const override {
    const phi::Pinhole pinhole = ReadCamera(image).pinhole;
    const phi::RayModel rays = phi::MakeRayModel(pinhole);
    const ColorImage colors = workspace_.ReadColor(image, pinhole.width, pinhole.height);
    const SceneMaps& maps = maps_[image];
    phi::FusionMap fusion_map(pinhole.width, pinhole.height);
    for (int y = 0; y < pinhole.height; ++y) {
      for (int x = 0; x < pinhole.width; ++x) {
        phi::FusionPixel& pixel = fusion_map(x, y);
        std::copy(colors(x, y).begin(), colors(x, y).end(), pixel.rgb);
        if (maps.inferred != nullptr && (*maps.inferred)(x, y) != 0) pixel.flags |= phi::FusionPixel::kInferred;
        const phi::PlaneHypothesis& h = (*maps.map)(x, y);
        if (!(h.depth > 0) || !std::isfinite(h.depth)) continue;
        pixel.depth = h.depth;
        pixel.normal = PackChecked(h.normal, rays, x, y);
      }
    }
    return fusion_map;
  }

 private:
  const Workspace& workspace_;
  const std::vector<SceneMaps>& maps_;
};

class MemoryCloud final : public CloudWriter {
 public:
  explicit MemoryCloud(SceneCloud* cloud) : cloud_(*cloud) {}
  void Write(phi::FusedBlock block) override { cloud_.blocks.push_back(std::move(block)); }
  void Commit() override {}

 private:
  SceneCloud& cloud_;
};

}  // namespace

std::vector<SceneMaps> EstimateScene(const Workspace& workspace, const std::vector<std::vector<int>>& sources,
                                     const PipelineOptions& options, const Backends& backends) {
  return MemoryRun(workspace, sources, options, backends, BuildStages(options)).Run(0);
}

std::vector<SceneMaps> FillScene(const Workspace& workspace, const std::vector<std::vector<int>>& sources,
                                 const std::vector<std::shared_ptr<const phi::PlaneMap>>& measured,
                                 const PipelineOptions& options, const Backends& backends) {
  MemoryRun run(workspace, sources, options, backends, BuildFillingStages(options));
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const auto map = std::make_shared<const phi::MeasurementMap>(phi::AllMeasured(*measured[i]));
    run.SetMap(static_cast<int>(i), std::string(kMeasured), {.map = map});
  }
  return run.Run(1);
}

SceneCloud FuseSceneMaps(const Workspace& workspace, const std::vector<SceneMaps>& maps, SceneFusionOptions options) {
  if (options.write_confidence_maps) {
    throw phi::UsageError(
        "--PhiFusion.write_confidence_maps writes files beside maps in files, and has no effect on those in memory; leave it out");
  }
  // For flags of scenes that do not fit in memory: others do without the folder, and TMPDIR may name one that is not there.
  std::error_code not_there;
  options.scratch_folder = std::filesystem::temp_directory_path(not_there);
  if (not_there) options.scratch_folder = "/tmp";
  SceneCloud cloud;
  MemoryCloud writer(&cloud);
  cloud.report = FuseScene(workspace, MemoryMaps(workspace, maps), options, &writer);
  return cloud;
}

}  // namespace colmap_ext

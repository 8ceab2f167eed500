// The interface behind which the CPU and the CUDA backends meet: whole images in, whole maps out.
//
// Implementations are safe to call from several threads at once (the scheduler runs several images of each of two stages per
// device so that uploads, kernels, downloads and the host's work overlap). All inputs are at one working resolution per
// view. Errors are phi::Error.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "phi/base/images.h"
#include "phi/filtering/judgement.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/options.h"
#include "phi/scene_view.h"

namespace phi {

struct EstimationInput {
  ViewImage reference;
  std::vector<ViewImage> sources;         // best first
  std::vector<SparseObservation> sparse;  // the points that may initialise depth; may be empty
  double noise = 0;                       // NoiseDeviation of the reference image, grey levels
  bool is_reduced = false;                // images and views are reduced ones, of a coarse start
  float depth_min = 0, depth_max = 0;  // robust range of the scene in this view, world units
  // Whether the user gave that range. The paper knows none but the sparse points' around each pixel: its hypotheses may
  // leave a range that was only estimated.
  bool depth_range_is_given = false;
  // Told the share of the work that is done, (0, 1], rising, by backends that need long for an image; may be empty.
  std::function<void(double)> tell_progress;
};

// What an estimation did, in numbers that are the same on every machine; 0 where a backend does not count.
struct EstimationCounts {
  std::int64_t hypotheses = 0;  // planes that were matched at a pixel, in one view or more
  std::int64_t windows = 0;     // of source images that were read for them
  std::int64_t samples = 0;     // bilinear ones, in these windows

  EstimationCounts& operator+=(const EstimationCounts& other) {
    hypotheses += other.hypotheses;
    windows += other.windows;
    samples += other.samples;
    return *this;
  }
};

struct EstimationResult {
  PlaneMap map;
  CostMap cost;
  EstimationCounts counts = {};
};

// The planes of `own` and of the sources are estimates. See phi/matching/share_pixel.h.
struct SharingInput {
  EstimationInput estimation;      // as of the estimation of the image; its sparse points do not count
  ViewMap own;
  std::vector<SourceMap> sources;  // those of the estimation that have a map, in their order
};

// The reference's states: none before inference, then as InferenceResult's.
struct FilterInput {
  ViewMap reference;
  std::vector<SourceMap> sources;
  std::shared_ptr<const CostMap> cost;  // null, or the reference's cost for FilterOptions::min_ncc
  std::optional<Judgement> judgement = {};  // of an estimate: what is kept is judged, too (JudgeMeasurements)
};

struct ImageRegions;  // phi/inference/image_regions.h
struct ViewRegions;   // phi/inference/source_regions.h
struct ViewChoice;    // phi/inference/view_choice.h

struct InferenceInput {
  ViewImage reference;
  std::vector<ViewImage> sources;
  std::shared_ptr<const MeasurementMap> measured;  // after the first filter
  // Hypotheses are matched in the first so many sources at most, and these tell free space. The others are witnesses of the
  // regions' planes alone: that is work of the host, and takes no memory of a device.
  int max_matched = kMaxSourceViews;
  // Of the sources: empty, or parallel to sources; null where there are none.
  std::vector<std::shared_ptr<const MeasuredDepths>> source_depths;
  // Of the sources, which have a say in the planes of the reference's regions (FindViewRegions): empty, or parallel to sources;
  // null where there are none.
  std::vector<std::shared_ptr<const ViewRegions>> source_regions;
  // What the reference's regions chose (ChooseRegionPlanes), to choose again; null: they choose once.
  std::shared_ptr<const ViewChoice> choice;
  // What the sources' regions chose: empty, or parallel to sources; null where it is not known.
  std::vector<std::shared_ptr<const ViewChoice>> source_choices;
  // Null, or what the reference leaves out: regions end there, and what other views measured behind it
  // carries nothing. The images are extended into their masks then.
  std::shared_ptr<const ImageMask> mask;
  // Of the reference's image, its mask cut out (FindRegions). Null: the backend finds them.
  std::shared_ptr<const ImageRegions> regions;
  float nearest = 0, farthest = std::numeric_limits<float>::infinity();  // of what is inferred: depths, world units
  bool keeps_measured = false;  // another program measured: holes are filled, and no measured pixel is made one

  std::size_t NumMatched() const { return std::min(sources.size(), static_cast<std::size_t>(max_matched)); }
  // Null where there are none.
  std::shared_ptr<const MeasuredDepths> DepthsOf(std::size_t source) const {
    return source < source_depths.size() ? source_depths[source] : nullptr;
  }
};

// Of the field: energies in Eq. 6 and 7's negative logarithms; 0 where no field was solved.
struct FieldStatistics {
  std::int64_t num_nodes = 0;
  double energy = 0, lower_bound = 0, min_cost_energy = 0;
  std::int64_t num_unlike_min_cost = 0;  // nodes whose label is not the one of lowest unary energy
  std::int64_t num_without_hypothesis = 0;  // pixels on the nodes' grid that are holes and no nodes
};

struct InferenceResult {
  // What is measured unchanged, the rest filled where a hypothesis was chosen.
  MeasurementMap map;
  FieldStatistics statistics;
};

// What a device worked on one stage.
struct DeviceStageTime {
  std::string stage;       // "estimation", "sharing", "filter" or "inference"
  int num_images = 0;      // calls
  double seconds = 0;      // in which the device was busy with the stage
  double num_samples = 0;  // bilinear samples of source images for ZNCC; 0: none, or not counted
};

// Calls of all stages at once, of a device that does so many of one: one stage's keep it busy while another's are on the host.
constexpr int NumCallsOfAllStages(int num_of_one) { return num_of_one > 1 ? 2 * num_of_one : 1; }

class Backend {
 public:
  virtual ~Backend() = default;
  virtual std::string Name() const = 0;         // for the log: "cpu (16 threads)", "cuda:0 NVIDIA H200"
  // How many calls of one stage at once keep the device busy, at least 1. More: those of several stages come side by side.
  virtual int NumConcurrentImages() const = 0;
  // Estimation with the default options, of the reference's pixels times source views, for a first guess of the time;
  // 0: not known.
  virtual double ExpectedPixelViewsPerSecond() const { return 0; }
  virtual EstimationResult Estimate(const EstimationInput& input, const StereoOptions& options) = 0;
  // The estimate of the image, in which what other images' estimates carry has replaced what clearly matches worse.
  virtual std::shared_ptr<const MeasurementMap> Share(const SharingInput& input, const StereoOptions& options) = 0;
  // What is kept, and clues where a judgement is asked; the rest has no depth.
  virtual MeasurementMap Filter(const FilterInput& input, const FilterOptions& options) = 0;
  virtual InferenceResult Infer(const InferenceInput& input, const StereoOptions& stereo,
                                const InferenceOptions& options) = 0;
  // Runs what the host does for a call beside it, in the call's threads.
  virtual void RunOnHost(const std::function<void()>& work) { work(); }
  // Gives up what it keeps for calls to come, which then make it anew. Not while calls are under way.
  virtual void FreeMemory() {}
  // The most device memory that was in use at once, for the summary of a run; 0: host memory only, or not known.
  virtual std::int64_t PeakDeviceBytes() const { return 0; }
  // For the same summary; empty where the host computes. Not while calls are under way.
  virtual std::vector<DeviceStageTime> DeviceStageTimes() const { return {}; }
};

std::unique_ptr<Backend> MakeCpuBackend(int num_threads);  // num_threads <= 0: all

}  // namespace phi

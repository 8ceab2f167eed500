#include "colmap_ext/fusion/scene_fuser.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <utility>

#include "colmap_ext/fusion_config.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/progress.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/base/log.h"
#include "phi/fusion/map_noise.h"
#include "phi/fusion/paper_fusion.h"

namespace colmap_ext {
namespace {

constexpr char kFusionStage[] = "fusion";
// Each image waits for the last block of the one before, so blocks are small; a device takes more pixels at once.
constexpr int kRowsPerBlock = 4, kRowsPerDeviceBlock = 16;
// Over the depth tolerance: what fusion does not feel. patch_match_stereo's maps have less, but for those of 300 pixels and less.
constexpr double kNegligibleNoise = 0.1;

// By their numbers, and not as the model lists them: programs write one model in several orders, and it has one cloud.
std::vector<int> ImagesToFuse(const Workspace& workspace) {
  std::vector<int> images;
  if (std::filesystem::exists(workspace.StereoFolder() / "fusion.cfg")) {
    images = ReadFusionConfig(workspace);
  } else {
    images.resize(workspace.views().size());
    std::iota(images.begin(), images.end(), 0);
  }
  const auto number = [&](int image) { return workspace.views()[static_cast<std::size_t>(image)].image_id; };
  std::sort(images.begin(), images.end(), [&](int a, int b) { return number(a) < number(b); });
  images.erase(std::unique(images.begin(), images.end()), images.end());
  return images;
}

}  // namespace

SceneFuser::SceneFuser(const Workspace& workspace, const FusionMapSource& maps,
                       const SceneFusionOptions& options)
    : workspace_(workspace), options_(options), reader_(maps), one_place_(workspace) {
  FindImages();
  flags_ = std::make_unique<FlagStore>(options.scratch_folder, images_.size(),
                                       IsPaper() ? phi::FusionPixel::kMerged : phi::FusionPixel::kEmitted);
  done_.assign(images_.size(), false);
  maps_.resize(images_.size());
  graph_ = BuildNeighborGraph(workspace, images_, one_place_, options.max_neighbors);
  FusionBackend backend = options.backend;
  if (IsPaper()) {
    backend = FusionBackend::kCpu;
    KeepImagesToCome(&graph_);
    parts_.emplace_back(images_.size());
    std::iota(parts_.front().begin(), parts_.front().end(), 0);
  } else {
    parts_ = DissectImages(graph_, options.max_part_images);
  }
  device_ = std::async(std::launch::async, [backend, gpus = options.gpus, num_lookups = NumLookups()] {
    return MakeFusionDevice(backend, gpus, num_lookups);
  });
}

void SceneFuser::Fuse(const std::vector<int>& order, CloudWriter* writer) {
  const FusionPlan plan = MakePlan(order);
  ProgressLine progress(ProgressStage{.name = "fusing"}, plan.steps.size());
  for (const FusionStep& step : plan.steps) {
    phi::ThrowIfCancelled();
    const ProgressLine::Task task(&progress);
    Drop(step.drop);
    Load(step.load);
    tbb::task_group group;
    group.run([&] { Load(step.load_ahead); });
    try {
      FuseStep(step, writer);
    } catch (...) {
      group.cancel();
      group.wait();
      throw;
    }
    group.wait();
    done_[Index(step.reference)] = true;
  }
  findings_.num_map_reads += plan.num_loads;
}

void SceneFuser::DropMaps() {
  std::vector<int> residents;
  for (std::size_t p = 0; p < maps_.size(); ++p) {
    if (maps_[p].size() > 0) residents.push_back(static_cast<int>(p));
  }
  Drop(residents);
}

std::vector<std::uint8_t> SceneFuser::FlagsOf(int position) const {
  return flags_->Load(position, static_cast<std::size_t>(NumPixels(position)));
}

void SceneFuser::SetDone(int position, const std::vector<std::uint8_t>& flags) {
  flags_->Save(position, flags);
  done_[Index(position)] = true;
}

SceneFuser::Findings SceneFuser::TakeFindings() { return std::exchange(findings_, {}); }

// Maps are large, and to give memory back takes time.
SceneFuser::~SceneFuser() {
  tbb::parallel_for(std::size_t{0}, maps_.size(), [&](std::size_t p) { maps_[p] = phi::FusionMap(); });
}

SceneFusionReport SceneFuser::MakeReport(const Findings& findings) const {
  SceneFusionReport report = known_;
  report.num_map_reads = findings.num_map_reads;
  report.num_points = findings.num_points;
  report.outcomes = findings.outcomes;
  for (const auto& [position, noise] : findings.noise) report.noise_of_smoothed_maps.push_back(noise);
  for (const auto& [position, message] : findings.failures) report.failures.push_back(ProblemOf(images_[Index(position)], message));
  report.num_images -= static_cast<int>(findings.failures.size());
  return report;
}

void SceneFuser::FindImages() {
  const std::vector<int> asked = ImagesToFuse(workspace_);
  std::vector<char> exists(asked.size());  // side by side: a shared disk takes half a millisecond to answer
  tbb::parallel_for(std::size_t{0}, asked.size(), [&](std::size_t i) { exists[i] = reader_.Exists(asked[i]); });
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (exists[i]) {
      images_.push_back(asked[i]);
    } else {
      ++known_.num_images_without_maps;
    }
  }
  known_.num_images = static_cast<int>(images_.size());
  const std::string kind = options_.input.kind;
  if (images_.empty()) {
    throw phi::InputError(phi::AboutStage(kFusionStage) + ": " + phi::AboutFile(workspace_.StereoFolder()) + " has no " + kind +
                          " depth and normal maps of the images in fusion.cfg; run patch_match_stereo first" +
                          (kind == kGeometric ? ", or choose --input_type photometric" : ""));
  }
  if (known_.num_images_without_maps > 0) {
    phi::LogWarning("fusion: " + std::to_string(known_.num_images_without_maps) + " of " +
                    std::to_string(known_.num_images_without_maps + known_.num_images) + " images have no " +
                    kind + " depth and normal maps and are left out");
  }
  ReadCameras();
  const auto has_mask = [&](int image) { return reader_.HasMask(image); };
  if (!options_.input.mask_path.empty() && std::none_of(images_.begin(), images_.end(), has_mask)) {
    phi::LogWarning("fusion: " + options_.input.mask_path.string() +
                    " holds no mask <image name>.png of any image; nothing is masked");
  }
}

void SceneFuser::ReadCameras() {
  std::vector<phi::Camera> cameras(images_.size());
  std::vector<phi::Message> problems(images_.size());
  tbb::parallel_for(std::size_t{0}, images_.size(), [&](std::size_t p) {
    try {
      cameras[p] = reader_.ReadCamera(images_[p]);
    } catch (const phi::InputError& error) {
      problems[p] = ProblemOf(images_[p], error.message());
    }
  });
  std::vector<int> images;
  for (std::size_t p = 0; p < problems.size(); ++p) {
    if (problems[p].empty()) {
      images.push_back(images_[p]);
      cameras_.push_back(cameras[p]);
    } else {
      phi::LogError(problems[p]);
      known_.failures.push_back(problems[p]);
    }
  }
  if (images.empty()) throw phi::InputError(phi::AboutStage(kFusionStage) + ": all maps are damaged: " + problems.front());
  images_ = images;
  known_.num_images = static_cast<int>(images_.size());
}

phi::Message SceneFuser::ProblemOf(int image, const phi::Message& problem) const {
  return WithContext(problem, phi::AboutImage(workspace_.views()[Index(image)].name) + phi::AboutStage(kFusionStage));
}

phi::FusionMap SceneFuser::ReadMap(int position) {
  try {
    return reader_.Read(images_[Index(position)]);
  } catch (const phi::InputError& error) {
    std::lock_guard<std::mutex> lock(findings_mutex_);
    if (findings_.failures.emplace(position, error.what()).second)
      phi::LogError(ProblemOf(images_[Index(position)], error.message()));
  }
  const phi::Pinhole& pinhole = cameras_[Index(position)].pinhole;
  return phi::FusionMap(pinhole.width, pinhole.height);
}

void SceneFuser::Smooth(int position, phi::FusionMap* map) {
  const float scale = options_.rule.method.rules.Factor(phi::Rule::kMapNoise);
  if (scale == 0) return;
  const phi::Pinhole& pinhole = cameras_[Index(position)].pinhole;
  const float noise = phi::EstimateNoise(*map, pinhole);
  if (noise <= scale * kNegligibleNoise * options_.rule.max_depth_error) return;
  phi::SmoothNoise(noise, pinhole, map, scale);
  std::lock_guard<std::mutex> lock(findings_mutex_);
  findings_.noise[position] = noise;
}

std::int64_t SceneFuser::NumPixels(int position) const {
  const phi::Pinhole& pinhole = cameras_[Index(position)].pinhole;
  return std::int64_t{pinhole.width} * pinhole.height;
}

std::int64_t SceneFuser::NumLookups() const {
  std::int64_t num = 0;
  for (int p = 0; p < static_cast<int>(images_.size()); ++p)
    num += NumPixels(p) * static_cast<std::int64_t>(graph_[Index(p)].size());
  return num;
}

phi::FusionDevice* SceneFuser::DeviceIfReady() const {
  return device_.wait_for(std::chrono::seconds(0)) == std::future_status::ready ? Device() : nullptr;
}

FusionPlan SceneFuser::MakePlan(const std::vector<int>& order) {
  std::vector<std::int64_t> bytes;
  std::int64_t largest = 0;
  for (int p = 0; p < static_cast<int>(images_.size()); ++p) {
    bytes.push_back(FusionMapReader::ResidentBytes(NumPixels(p)));
    largest = std::max(largest, FusionMapReader::TransientBytes(NumPixels(p)));
  }
  // At most a quarter of the budget is for maps that are just being read, however many threads read: the plan decides which neighbours
  // fit, and so the cloud.
  constexpr std::int64_t kMostReads = 32;
  const std::int64_t budget = options_.MemoryBytes();
  num_concurrent_reads_ = static_cast<int>(std::clamp<std::int64_t>(budget / 4 / largest, 1, kMostReads));
  const std::int64_t bytes_of_reads = num_concurrent_reads_ * largest;
  if (!std::exchange(has_told_of_shortage_, true)) {
    TellOfShortage(FindShortage(graph_, bytes, budget - bytes_of_reads), bytes_of_reads);
  }
  return PlanFusion(graph_, order, bytes, budget - bytes_of_reads);
}

void SceneFuser::TellOfShortage(const MemoryShortage& shortage, std::int64_t bytes_of_reads) const {
  if (shortage.num_images == 0) return;
  phi::LogWarning("fusion: " + std::to_string(shortage.num_images) +
                  " images are compared with fewer neighbours than --StereoFusion.check_num_images for want of memory; "
                  "--PhiFusion.max_memory_gb " +
                  std::to_string((shortage.bytes_wanted + bytes_of_reads) / 1000000000 + 1) + " would be enough");
}

void SceneFuser::Drop(const std::vector<int>& positions) {
  for (const int p : positions) {
    const bool is_done = done_[Index(p)] != 0;
    if (IsPaper() ? !is_done : is_done) flags_->Save(p, maps_[Index(p)]);
    if (phi::FusionDevice* device = DeviceIfReady(); device != nullptr) device->Forget(MapOf(p));
    maps_[Index(p)] = phi::FusionMap();
  }
}

// Batches bound what is in memory only while maps are being read.
void SceneFuser::Load(const std::vector<int>& positions) {
  const std::size_t batch = static_cast<std::size_t>(num_concurrent_reads_);
  for (std::size_t begin = 0; begin < positions.size(); begin += batch) {
    phi::ThrowIfCancelled();
    tbb::parallel_for(begin, std::min(begin + batch, positions.size()), [&](std::size_t i) {
      phi::FusionMap map = ReadMap(positions[i]);
      if (!IsPaper()) Smooth(positions[i], &map);
      flags_->Restore(positions[i], &map);
      maps_[Index(positions[i])] = std::move(map);
      if (phi::FusionDevice* device = DeviceIfReady(); device != nullptr) device->Load(MapOf(positions[i]));
    });
  }
}

phi::ImageFuser::Image SceneFuser::MakeImage(int position) {
  return {static_cast<std::uint32_t>(images_[Index(position)]), cameras_[Index(position)],
          &maps_[Index(position)], done_[Index(position)] != 0};
}

template <typename Compute>
void SceneFuser::WriteBlocks(BlockRows rows, CloudWriter* writer, const Compute& compute) {
  int next_row = 0;
  const auto next_block = [&](tbb::flow_control& control) {
    const int begin = next_row;
    if (begin >= rows.height) control.stop();
    next_row += rows.per_block;
    return begin;
  };
  struct Block {
    std::int64_t num_points = 0;
    phi::OutcomeCounts outcomes;
    std::function<void()> write;
  };
  using BlockHandle = std::shared_ptr<Block>;
  const auto compute_block = [&](int begin) {
    phi::FusedBlock fused = compute(begin, std::min(begin + rows.per_block, rows.height));
    auto block = std::make_shared<Block>();
    block->num_points = static_cast<std::int64_t>(fused.points.size());
    block->outcomes = fused.outcomes;
    block->write = writer->Prepare(std::move(fused));
    return block;
  };
  const auto write = [&](const BlockHandle& block) {
    findings_.num_points += block->num_points;
    findings_.outcomes += block->outcomes;
    block->write();
  };
  tbb::parallel_pipeline(static_cast<std::size_t>(2 * tbb::this_task_arena::max_concurrency()),
                         tbb::make_filter<void, int>(tbb::filter_mode::serial_in_order, next_block) &
                             tbb::make_filter<int, BlockHandle>(tbb::filter_mode::parallel, compute_block) &
                             tbb::make_filter<BlockHandle, void>(tbb::filter_mode::serial_in_order, write));
}

void SceneFuser::FuseStep(const FusionStep& step, CloudWriter* writer) {
  std::vector<phi::ImageFuser::Image> neighbors;
  for (const int p : step.neighbors) {
    neighbors.push_back(MakeImage(p));
    neighbors.back().stands_apart = !one_place_.StandTogether(images_[Index(step.reference)], images_[Index(p)]);
  }
  const phi::BoundingBox* box = options_.box ? &*options_.box : nullptr;
  phi::FusionDevice* const device = Device();
  const BlockRows rows = {cameras_[Index(step.reference)].pinhole.height, device != nullptr ? kRowsPerDeviceBlock : kRowsPerBlock};
  if (IsPaper()) {
    const phi::PaperFuser fuser(MakeImage(step.reference), neighbors, options_.rule, box);
    return WriteBlocks(rows, writer, [&](int begin, int end) { return fuser.FuseRows(begin, end); });
  }
  phi::ImageFuser fuser(MakeImage(step.reference), neighbors, options_.rule, box, device);
  WriteBlocks(rows, writer, [&](int begin, int end) { return fuser.FuseRows(begin, end); });
  WriteBlocks(rows, writer, [&](int begin, int end) { return fuser.FillHoles(begin, end); });
  if (options_.write_confidence_maps) WriteConfidenceMap(fuser, step.reference);
}

bool SceneFuser::IsDamaged(int position) {
  std::lock_guard<std::mutex> lock(findings_mutex_);
  return findings_.failures.contains(position);
}

void SceneFuser::WriteConfidenceMap(const phi::ImageFuser& fuser, int position) {
  if (IsDamaged(position)) return;
  const phi::Pinhole& size = cameras_[Index(position)].pinhole;
  phi::Array2D<float> confidence(size.width, size.height, 0);
  tbb::parallel_for(tbb::blocked_range<int>(0, size.height, kRowsPerBlock),
                    [&](const tbb::blocked_range<int>& rows) { fuser.RateRows(rows.begin(), rows.end(), &confidence); });
  WriteDepthMap(workspace_.ConfidenceMapPath(images_[Index(position)], options_.input.kind), confidence);
}

}  // namespace colmap_ext

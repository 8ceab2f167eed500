// The fusion of a scene's images in a given order, or of some of them: reads maps ahead of their use and drops them after it,
// keeps the state of what was fused.
#pragma once

#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <tbb/task_arena.h>

#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/fusion/flag_store.h"
#include "colmap_ext/fusion/fusion_parts.h"
#include "colmap_ext/fusion/fusion_plan.h"
#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/one_place.h"
#include "phi/base/error.h"
#include "phi/fusion/image_fusion.h"

namespace colmap_ext {

// function() on as many threads as the options say.
template <typename Function>
auto OnFusionThreads(const SceneFusionOptions& options, const Function& function) {
  tbb::task_arena arena(options.num_threads > 0 ? options.num_threads : tbb::task_arena::automatic);
  return arena.execute(function);
}

// Positions as in NeighborGraph index the images that are fused.
class SceneFuser {
 public:
  // References must outlive it. Throws phi::InputError when no image has maps that can be read.
  SceneFuser(const Workspace& workspace, const FusionMapSource& maps, const SceneFusionOptions& options);
  ~SceneFuser();
  SceneFuser(const SceneFuser&) = delete;
  SceneFuser& operator=(const SceneFuser&) = delete;

  const std::vector<int>& images() const { return images_; }  // by position: index into the workspace's views
  const std::vector<phi::Camera>& cameras() const { return cameras_; }
  const NeighborGraph& graph() const { return graph_; }
  // In the order of fusion. Of the paper's fusion, which has no parts: one with all images.
  const std::vector<FusionPart>& parts() const { return parts_; }

  // Fuses these images, whose earlier neighbours are done. No map may be in memory.
  void Fuse(const std::vector<int>& order, CloudWriter* writer);
  void DropMaps();

  // What later images must know of one that is done and not in memory: which of its pixels gave points, a bit each.
  std::vector<std::uint8_t> FlagsOf(int position) const;
  bool IsDone(int position) const { return done_[Index(position)] != 0; }
  // An image that was fused elsewhere.
  void SetDone(int position, const std::vector<std::uint8_t>& flags);

  // Of all images that this fuser has fused. By position: those that turned out damaged, and the noise of smoothed maps.
  struct Findings {
    std::int64_t num_map_reads = 0, num_points = 0;
    phi::OutcomeCounts outcomes;
    std::map<int, std::string> failures;
    std::map<int, double> noise;
  };
  // The findings since the last call; the fuser forgets them.
  Findings TakeFindings();
  // With what is known of all images before any is fused.
  SceneFusionReport MakeReport(const Findings& findings) const;

 private:
  static std::size_t Index(int position) { return static_cast<std::size_t>(position); }
  bool IsPaper() const { return options_.rule.method.formulas == phi::Formulas::kPaper; }

  void FindImages();
  // From the maps' headers. Images whose maps are damaged are left out.
  void ReadCameras();
  std::int64_t NumPixels(int position) const;
  std::int64_t NumLookups() const;
  // Null: the processor decides. Waits until a GPU has started.
  phi::FusionDevice* Device() const { return device_.get().get(); }
  // Null, too, while it starts.
  phi::FusionDevice* DeviceIfReady() const;
  FusionPlan MakePlan(const std::vector<int>& order);
  void TellOfShortage(const MemoryShortage& shortage, std::int64_t bytes_of_reads) const;
  // Without depth where a file is damaged: it gives no points, and the images around it do without it.
  phi::FusionMap ReadMap(int position);
  // Maps with more noise from pixel to pixel than the depth tolerance leaves unnoticed.
  void Smooth(int position, phi::FusionMap* map);
  void Drop(const std::vector<int>& positions);
  void Load(const std::vector<int>& positions);
  phi::ArrayView2D<const phi::FusionPixel> MapOf(int position) const { return maps_[Index(position)].view(); }
  phi::ImageFuser::Image MakeImage(int position);
  void FuseStep(const FusionStep& step, CloudWriter* writer);
  // Of an image, and those that are computed as one block.
  struct BlockRows {
    int height, per_block;
  };
  // Blocks of rows, computed in parallel and written in their order.
  template <typename Compute>
  void WriteBlocks(BlockRows rows, CloudWriter* writer, const Compute& compute);

  // Of a fused image, unless a file of it turned out damaged.
  void WriteConfidenceMap(const phi::ImageFuser& fuser, int position);
  bool IsDamaged(int position);  // as far as is known

  // Of an image whose maps cannot be read.
  phi::Message ProblemOf(int image, const phi::Message& problem) const;

  const Workspace& workspace_;
  const SceneFusionOptions& options_;
  const FusionMapSource& reader_;
  const OnePlace one_place_;
  std::vector<int> images_;
  std::vector<phi::Camera> cameras_;
  NeighborGraph graph_;
  std::vector<FusionPart> parts_;
  std::vector<phi::FusionMap> maps_;  // empty: not in memory
  std::vector<char> done_;            // fused; not bool, whose elements share bytes
  std::unique_ptr<FlagStore> flags_;
  // It starts while the first maps are read.
  std::shared_future<std::unique_ptr<phi::FusionDevice>> device_;
  int num_concurrent_reads_ = 1;
  bool has_told_of_shortage_ = false;  // of all parts, before the first
  std::mutex findings_mutex_;  // of failures and noise
  Findings findings_;
  SceneFusionReport known_;  // before any image is fused
};

}  // namespace colmap_ext

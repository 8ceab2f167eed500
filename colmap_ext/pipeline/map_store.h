// Images and maps of a workspace for the stages: from memory where they fit the budget, else from files.
// Results are written beside the computation.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "colmap_ext/pipeline/memory_cache.h"
#include "colmap_ext/pipeline/writer_pool.h"
#include "colmap_ext/workspace.h"
#include "phi/backend.h"

namespace colmap_ext {

// What a stage makes of an image. cost and mask may be null.
struct StageResult {
  std::shared_ptr<const phi::PlaneMap> map = nullptr;
  std::shared_ptr<const phi::CostMap> cost = nullptr;
  // Of a measured map: which pixels have few witnesses (phi/filtering/few_witnesses.h). Of an inferred or geometric one:
  // which are inferred (phi/filtering/filled_value.h).
  std::shared_ptr<const phi::Mask> mask = nullptr;
};

// Thread-safe.
class MapStore {
 public:
  MapStore(const Workspace& workspace, std::int64_t budget_bytes, int num_writers);

  // Extended into the mask, where the image has one; see phi/base/image_mask.h.
  std::shared_ptr<const phi::GrayImage> Gray(int image);
  // The same with the mask cut out.
  std::shared_ptr<const phi::GrayImage> CutGray(int image);
  // Null where the image has none.
  std::shared_ptr<const phi::ImageMask> ImageMask(int image);
  // Maps have no depth where the image is masked, whoever made them.
  std::shared_ptr<const phi::PlaneMap> Map(int image, const std::string& kind);
  // The map's depths alone, of measured maps without those that have few witnesses.
  std::shared_ptr<const phi::DepthMap> Depths(int image, const std::string& kind);
  std::shared_ptr<const phi::CostMap> Cost(int image, const std::string& kind);
  std::shared_ptr<const phi::Mask> MaskOf(int image, const std::string& kind);

  // Writes the files at once and keeps nothing in memory.
  void WriteFiles(int image, const std::string& kind, const StageResult& result) const;
  // Queues the files for writing; `on_written` is called from the writer's thread once they are there.
  void Write(int image, const std::string& kind, const StageResult& result, std::function<void()> on_written);
  // Keeps a result that gets files only when the budget asks for its place.
  void KeepTransient(int image, const std::string& kind, const StageResult& result);

  // Gives up the memory of a result that no stage reads any more, but for its cost.
  void Forget(int image, const std::string& kind);

  // Whether the files of a result are there and have the size of the image.
  bool FilesAreWhole(int image, const std::string& kind, bool with_cost, bool with_mask) const;
  void RemoveFiles(int image, const std::string& kind) const;

  void Drain() { writers_.Drain(); }
  const WriterPool& writers() const { return writers_; }
  const MemoryCache& cache() const { return cache_; }

 private:
  const Workspace& workspace_;
  MemoryCache cache_;
  WriterPool writers_;  // after what its jobs use
};

}  // namespace colmap_ext

// Images and maps of a workspace for the stages: from memory where they fit the budget, else from files.
// Results are written beside the computation.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/map_file.h"
#include "colmap_ext/pipeline/memory_cache.h"
#include "colmap_ext/pipeline/result_files.h"
#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/writer_pool.h"
#include "colmap_ext/workspace.h"
#include "phi/backend.h"
#include "phi/base/message.h"
#include "phi/inference/image_regions.h"
#include "phi/inference/source_regions.h"
#include "phi/inference/view_choice.h"

namespace colmap_ext {

// What a stage makes of an image.
struct StageResult {
  std::shared_ptr<const phi::MeasurementMap> map = nullptr;  // without states: no mask beside its files
  std::shared_ptr<const phi::CostMap> cost = nullptr;        // may be null
};

// What lies under the names of a result.
struct FoundFiles {
  bool whole = false;             // all of them, as the record knows them, and none of another result
  std::filesystem::path foreign;  // the first that is not ours and must not be replaced unasked; empty: none
};

// Thread-safe.
class MapStore {
 public:
  MapStore(const Workspace& workspace, std::int64_t budget_bytes, int num_writers);

  // Writes the maps of these kinds as compact maps (compact_map.h), to which they are rounded, from now on. Those of other
  // kinds get COLMAP's form; a map is read from the form in which it is there.
  void WriteCompactly(std::set<std::string> kinds) { compact_kinds_ = std::move(kinds); }
  bool WritesCompactly(const std::string& kind) const { return compact_kinds_.contains(kind); }

  // Extended into the mask, where the image has one; see phi/base/image_mask.h.
  std::shared_ptr<const phi::GrayImage> Gray(int image);
  // The same with the mask cut out.
  std::shared_ptr<const phi::GrayImage> CutGray(int image);
  // Of the same; `rules`: one for all calls.
  std::shared_ptr<const phi::ImageRegions> Regions(int image, const phi::Rules& rules);
  // What an image's regions tell others, and what they choose. `find` is called unless that is in memory, once for all that ask at a
  // time; it may ask for those of other images, but for none that asks for this one.
  std::shared_ptr<const phi::ViewRegions> ToldRegions(int image, const std::function<phi::ViewRegions()>& find);
  std::shared_ptr<const phi::ViewChoice> Choice(int image, const std::function<phi::ViewChoice()>& find);
  bool HasImageMask(int image) const;
  // Null where the image has none.
  std::shared_ptr<const phi::ImageMask> ImageMask(int image);
  // Maps have no depth where the image is masked, whoever made them.
  std::shared_ptr<const phi::MeasurementMap> Map(int image, const std::string& kind);
  // The same, and null where it is not in memory now.
  std::shared_ptr<const phi::MeasurementMap> FindMap(int image, const std::string& kind) const;
  // The map without its normals.
  std::shared_ptr<const phi::MeasuredDepths> Depths(int image, const std::string& kind);
  std::shared_ptr<const phi::CostMap> Cost(int image, const std::string& kind);

  // Keeps the files of photos from now on, as long as nothing else needs their place: for who reads the photos after the
  // stages. Not of a workspace in memory.
  void KeepPhotos() { keeps_photos_ = true; }
  // Null where it is not in memory now.
  std::shared_ptr<const PhotoFile> FindPhoto(int image) const;

  // Queues the files for writing. `on_complete` is called from the writer's thread with what identifies them, before the
  // first of them has its name: see RunRecord::Finish. Files and record are on the disk before the names are.
  using OnComplete = std::function<void(const std::vector<FileIdentity>& files)>;
  void Write(int image, const std::string& kind, const StageResult& result, OnComplete on_complete);
  // Writes the files at once and keeps nothing in memory.
  void Save(int image, const std::string& kind, const StageResult& result);
  bool IsCompact(int image, const std::string& kind) const;
  // The mask that goes with a map, at once.
  void SaveStates(int image, const std::string& kind, const phi::StateMap& states) const;
  // Keeps a result that gets files only when the budget asks for its place.
  void KeepTransient(int image, const std::string& kind, const StageResult& result);
  // Keeps a result that gets no files, whatever the budget.
  void KeepInMemory(int image, const std::string& kind, const StageResult& result);

  // Gives up the memory of a result that no stage reads any more, but for its cost.
  void Forget(int image, const std::string& kind);
  void ForgetRegions(int image);

  // Compares what lies under all names of a result (result_files.h) with what the record knows of it (null: nothing).
  FoundFiles Inspect(int image, const std::string& kind, bool with_cost, bool with_mask,
                     const TaskRecord* record) const;
  // Of the maps alone, without mask and cost.
  bool MapsAreOurs(int image, const std::string& kind, const TaskRecord& record) const;
  bool HasMask(int image, const std::string& kind) const;
  // Whether the maps of a result are there and have the size of the image, whoever made them.
  bool MapsAreWhole(int image, const std::string& kind) const;
  // Empty where they are, else which file is not and what to do.
  phi::Message MapsProblem(int image, const std::string& kind) const;
  void RemoveFiles(int image, const std::string& kind);

  // Waits until everything is written, and puts the names of the new files on the disk, a folder at a time.
  void Drain();
  const WriterPool& writers() const { return writers_; }
  const MemoryCache& cache() const { return cache_; }
  std::int64_t peak_bytes() const { return cache_.peak_bytes() + told_.peak_bytes(); }

 private:
  std::shared_ptr<const phi::GrayImage> ReadGray(int image);
  // Of a result, in the form in which it is there.
  std::vector<std::filesystem::path> FilesOf(int image, const std::string& kind, bool with_cost, bool with_mask) const;
  // What lies under the names of a result that consists of these files, and is none of them: the other form, a mask or costs
  // that an earlier result had.
  void RemoveOthers(int image, const std::string& kind, const CompleteFiles& files) const;
  CompleteFiles PrepareFiles(int image, const std::string& kind, const StageResult& result,
                             Durability durability) const;
  // A result whose files are complete and recorded.
  struct Ready {
    CompleteFiles files;
    int image = 0;
    std::string kind;
    std::int64_t num_bytes = 0;
  };
  void Publish(Ready ready);
  void PublishBatch(const std::vector<Ready>& batch);

  const Workspace& workspace_;
  const std::int64_t max_waiting_bytes_;
  ConfidenceRemoval confidence_;
  bool keeps_photos_ = false;
  std::set<std::string> compact_kinds_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable published_;
  bool is_publishing_ = false;
  std::vector<Ready> waiting_;
  std::int64_t waiting_bytes_ = 0;
  std::set<std::filesystem::path> unsynced_folders_;
  MemoryCache cache_;
  MemoryCache told_;  // by images' regions: small, and many ask for each, so maps must not drive it out
  WriterPool writers_;  // after what its jobs use
};

}  // namespace colmap_ext

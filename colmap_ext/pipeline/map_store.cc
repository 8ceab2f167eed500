#include "colmap_ext/pipeline/map_store.h"

#include <algorithm>
#include <exception>
#include <system_error>
#include <utility>

#include <tbb/task_arena.h>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/measurement_file.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// Results that are written and wait for the disk, their maps still in memory, take one part in so many of the budget. Beyond
// that writers wait too, and soon whoever computes.
constexpr std::int64_t kWaitingParts = 8;
// What regions tell and choose takes about a megabyte an image, whatever its size, and an image asks for that of a hundred others.
std::int64_t ToldBytes(std::int64_t budget) {
  constexpr std::int64_t kEnough = std::int64_t{256} << 20;
  return std::max(budget / 16, std::min(budget / 4, kEnough));
}

constexpr char kRegions[] = "regions", kToldRegions[] = "told regions", kChoice[] = "choice";

template <typename T>
MemoryCache::Sized MakeSized(std::shared_ptr<const T> item) {
  const auto num_bytes = static_cast<std::int64_t>(item->bytes());
  return {std::move(item), num_bytes};
}

template <typename T, typename Read>
std::shared_ptr<const T> GetOrRead(MemoryCache& cache, const MemoryCache::Key& key, const Read& read) {
  const auto item = cache.GetOrLoad(key, [&] { return MakeSized<T>(std::make_shared<const T>(read())); });
  return std::static_pointer_cast<const T>(item);
}

// A thread that waits within `find` must not begin another task meanwhile: it might wait for what waits for this one.
template <typename T>
std::shared_ptr<const T> FindAlone(MemoryCache& cache, const MemoryCache::Key& key, const std::function<T()>& find) {
  return GetOrRead<T>(cache, key, [&] { return tbb::this_task_arena::isolate(find); });
}

std::string DepthsKey(const std::string& kind) { return kind + " depths"; }
constexpr char kPhoto[] = "photo";
std::string CostKey(const std::string& kind) { return kind + " cost"; }

// Empty where the map is whole and of the size; else why not.
phi::Message SizeProblem(const fs::path& path, const phi::Pinhole& pinhole, int channels) {
  std::error_code unreachable;
  if (!fs::exists(path, unreachable)) return phi::AboutFile(path) + " is missing";
  try {
    const MapSize size = path.extension() == ".map" ? ReadCompactMapSize(path) : ReadMapSize(path);
    if (size.width == pinhole.width && size.height == pinhole.height && size.channels == channels) return "";
    return phi::AboutFile(path) + " has " + SizeText(size.width, size.height) + " pixels and " + std::to_string(size.channels) +
           " channel(s), not " + SizeText(pinhole.width, pinhole.height) + " and " + std::to_string(channels) +
           "; give the --PatchMatchStereo.max_image_size that it was made with";
  } catch (const phi::InputError& error) {
    return error.message();
  }
}

}  // namespace

MapStore::MapStore(const Workspace& workspace, std::int64_t budget_bytes, int num_writers)
    : workspace_(workspace),
      max_waiting_bytes_(budget_bytes / kWaitingParts),
      confidence_(workspace),
      cache_(budget_bytes - ToldBytes(budget_bytes)),
      told_(ToldBytes(budget_bytes)),
      writers_(num_writers) {}

std::shared_ptr<const phi::GrayImage> MapStore::Gray(int image) {
  const auto item = cache_.GetOrLoad({image, "gray"}, [&] {
    std::shared_ptr<const phi::GrayImage> gray = ReadGray(image);
    const auto mask = ImageMask(image);
    if (mask != nullptr) gray = std::make_shared<const phi::GrayImage>(phi::ExtendIntoMask(*gray, *mask));
    return MakeSized(gray);
  });
  return std::static_pointer_cast<const phi::GrayImage>(item);
}

std::shared_ptr<const phi::GrayImage> MapStore::ReadGray(int image) {
  if (!keeps_photos_) return workspace_.ReadGray(image);
  std::shared_ptr<const PhotoFile> photo = FindPhoto(image);
  if (photo == nullptr) {
    photo = workspace_.ReadPhoto(image);
    cache_.PutSpare({image, kPhoto}, {photo, static_cast<std::int64_t>(photo->bytes.size())});
  }
  return workspace_.ReadGray(image, photo.get());
}

std::shared_ptr<const PhotoFile> MapStore::FindPhoto(int image) const {
  return std::static_pointer_cast<const PhotoFile>(cache_.Find({image, kPhoto}));
}

std::shared_ptr<const phi::GrayImage> MapStore::CutGray(int image) {
  const auto mask = ImageMask(image);
  if (mask == nullptr) return Gray(image);
  return GetOrRead<phi::GrayImage>(cache_, {image, "cut gray"},
                                   [&] { return phi::CutOutMask(*Gray(image), *mask); });
}

std::shared_ptr<const phi::ImageRegions> MapStore::Regions(int image, const phi::Rules& rules) {
  return GetOrRead<phi::ImageRegions>(cache_, {image, kRegions}, [&] { return phi::FindRegions(*CutGray(image), rules); });
}

std::shared_ptr<const phi::ViewRegions> MapStore::ToldRegions(int image, const std::function<phi::ViewRegions()>& find) {
  return FindAlone<phi::ViewRegions>(told_, {image, kToldRegions}, find);
}

std::shared_ptr<const phi::ViewChoice> MapStore::Choice(int image, const std::function<phi::ViewChoice()>& find) {
  return FindAlone<phi::ViewChoice>(told_, {image, kChoice}, find);
}

void MapStore::ForgetRegions(int image) {
  cache_.Erase({image, kRegions});
  told_.Erase({image, kToldRegions});
  told_.Erase({image, kChoice});
}

bool MapStore::HasImageMask(int image) const { return workspace_.HasImageMask(image); }

std::shared_ptr<const phi::ImageMask> MapStore::ImageMask(int image) {
  if (!HasImageMask(image)) return nullptr;
  const auto item =
      cache_.GetOrLoad({image, "mask"}, [&] { return MakeSized(workspace_.ReadImageMask(image)); });
  return std::static_pointer_cast<const phi::ImageMask>(item);
}

std::shared_ptr<const phi::MeasurementMap> MapStore::Map(int image, const std::string& kind) {
  return GetOrRead<phi::MeasurementMap>(cache_, {image, kind}, [&] {
    phi::MeasurementMap map = ReadMeasurements(workspace_, image, kind);
    if (const auto mask = ImageMask(image); mask != nullptr) phi::DropMasked(*mask, &map);
    return map;
  });
}

std::shared_ptr<const phi::MeasurementMap> MapStore::FindMap(int image, const std::string& kind) const {
  return std::static_pointer_cast<const phi::MeasurementMap>(cache_.Find({image, kind}));
}

std::shared_ptr<const phi::MeasuredDepths> MapStore::Depths(int image, const std::string& kind) {
  return GetOrRead<phi::MeasuredDepths>(cache_, {image, DepthsKey(kind)}, [&] {
    // A map that has no file yet is in memory.
    const auto map = FindMap(image, kind);
    phi::MeasuredDepths depths =
        map != nullptr ? phi::DepthsOf(*map) : ReadMeasuredDepths(workspace_, image, kind);
    if (const auto mask = ImageMask(image); mask != nullptr) phi::DropMasked(*mask, &depths);
    return depths;
  });
}

std::shared_ptr<const phi::CostMap> MapStore::Cost(int image, const std::string& kind) {
  return GetOrRead<phi::CostMap>(cache_, {image, CostKey(kind)},
                                 [&] { return ReadDepthMap(workspace_.CostMapPath(image, kind)); });
}

void MapStore::Write(int image, const std::string& kind, const StageResult& result, OnComplete on_complete) {
  cache_.PutPinned({image, kind}, MakeSized(result.map));
  if (result.cost) cache_.PutPinned({image, CostKey(kind)}, MakeSized(result.cost));
  writers_.Submit([this, image, kind, result, on_complete = std::move(on_complete)] {
    CompleteFiles files = PrepareFiles(image, kind, result, Durability::kProcess);
    std::vector<FileIdentity> identities;
    for (const auto& file : files) identities.push_back(IdentifyFile(file->temporary_path()));
    on_complete(identities);
    std::int64_t num_bytes = 0;
    for (const FileIdentity& identity : identities) num_bytes += identity.num_bytes;
    Publish({std::move(files), image, kind, num_bytes});
    return num_bytes;
  });
}

void MapStore::Save(int image, const std::string& kind, const StageResult& result) {
  const CompleteFiles files = PrepareFiles(image, kind, result, Durability::kProcess);
  confidence_.Remove(kind);
  for (const auto& file : files) file->Publish();
  RemoveOthers(image, kind, files);
}

bool MapStore::IsCompact(int image, const std::string& kind) const {
  std::error_code unreachable;
  return fs::exists(CompactMapPath(workspace_, image, kind), unreachable);
}

void MapStore::SaveStates(int image, const std::string& kind, const phi::StateMap& states) const {
  WriteMask(workspace_.FilledMaskPath(image, kind), MaskOfStates(states));
}

void MapStore::KeepTransient(int image, const std::string& kind, const StageResult& result) {
  cache_.PutTransient({image, kind}, MakeSized(result.map), [this, image, kind](const MemoryCache::Item& item) {
    try {
      Save(image, kind, {.map = std::static_pointer_cast<const phi::MeasurementMap>(item)});
    } catch (const phi::InputError& error) {
      throw phi::ResourceError(error.message());  // not the fault of the image whose turn it is
    }
  });
}

void MapStore::KeepInMemory(int image, const std::string& kind, const StageResult& result) {
  cache_.PutPinned({image, kind}, MakeSized(result.map));
  if (result.cost) cache_.PutPinned({image, CostKey(kind)}, MakeSized(result.cost));
}

void MapStore::Forget(int image, const std::string& kind) {
  for (const std::string& key : {kind, DepthsKey(kind)}) cache_.Erase({image, key});
}

CompleteFiles MapStore::PrepareFiles(int image, const std::string& kind, const StageResult& result,
                                     Durability durability) const {
  CompleteFiles files;
  const auto append = [&files](CompleteFiles more) {
    for (auto& file : more) files.push_back(std::move(file));
  };
  const phi::MeasurementMap& map = *result.map;
  if (WritesCompactly(kind)) {
    if (result.cost) append(PrepareDepthMap(workspace_.CostMapPath(image, kind), *result.cost, durability));
    files.push_back(PrepareCompactMap(CompactMapPath(workspace_, image, kind), map, durability));
    return files;
  }
  if (!map.states.empty())
    files.push_back(PrepareMask(workspace_.FilledMaskPath(image, kind), MaskOfStates(map.states), durability));
  if (result.cost) append(PrepareDepthMap(workspace_.CostMapPath(image, kind), *result.cost, durability));
  append(PreparePlaneMap(workspace_.DepthMapPath(image, kind), workspace_.NormalMapPath(image, kind), map.planes,
                         durability));
  return files;
}

// Waiting for the disk takes the same time for one result as for many. One writer at a time does it, for all results that
// have become ready meanwhile; the others go on writing.
void MapStore::Publish(Ready ready) {
  std::unique_lock<std::mutex> lock(mutex_);
  waiting_bytes_ += ready.num_bytes;
  waiting_.push_back(std::move(ready));
  published_.wait(lock, [this] { return !is_publishing_ || waiting_bytes_ <= max_waiting_bytes_; });
  if (is_publishing_) return;
  is_publishing_ = true;
  std::exception_ptr error;
  while (!waiting_.empty() && !error) {
    const std::vector<Ready> batch = std::exchange(waiting_, {});
    waiting_bytes_ = 0;
    lock.unlock();
    published_.notify_all();
    try {
      PublishBatch(batch);
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
  }
  is_publishing_ = false;
  published_.notify_all();
  if (error) std::rethrow_exception(error);
}

// The new names are put on the disk at the end of the run: a result whose names a power cut takes back is made again.
void MapStore::PublishBatch(const std::vector<Ready>& batch) {
  std::set<fs::path> folders = {workspace_.StereoFolder()};  // of the journal
  for (const Ready& ready : batch) {
    for (const auto& file : ready.files) folders.insert(file->folder());
  }
  SyncFileSystems(folders);
  for (const Ready& ready : batch) {
    confidence_.Remove(ready.kind);
    for (const auto& file : ready.files) file->Publish();
    RemoveOthers(ready.image, ready.kind, ready.files);
    cache_.Unpin({ready.image, ready.kind});
    cache_.Unpin({ready.image, CostKey(ready.kind)});
  }
  std::lock_guard<std::mutex> lock(mutex_);
  unsynced_folders_.merge(folders);
}

void MapStore::Drain() {
  writers_.Drain();
  std::lock_guard<std::mutex> lock(mutex_);
  for (const fs::path& folder : unsynced_folders_) SyncFolder(folder);
  unsynced_folders_.clear();
}

FoundFiles MapStore::Inspect(int image, const std::string& kind, bool with_cost, bool with_mask,
                             const TaskRecord* record) const {
  FoundFiles found{.whole = record != nullptr, .foreign = {}};
  const std::vector<fs::path> files = FilesOf(image, kind, with_cost, with_mask);
  for (const fs::path& path : ResultPaths(workspace_, image, kind)) {
    const FileState state = StateOf(path, record);
    const bool is_asked_for = std::find(files.begin(), files.end(), path) != files.end();
    // One that is not would be read together with the result: a mask of earlier maps, which a killed run left.
    found.whole &= state == FileState::kCurrent || (state == FileState::kMissing && !is_asked_for);
    if (state == FileState::kForeign && found.foreign.empty()) found.foreign = path;
  }
  return found;
}

bool MapStore::MapsAreOurs(int image, const std::string& kind, const TaskRecord& record) const {
  const std::vector<fs::path> files = FilesOf(image, kind, false, false);
  return std::none_of(files.begin(), files.end(),
                      [&](const fs::path& path) { return StateOf(path, &record) == FileState::kForeign; });
}

std::vector<fs::path> MapStore::FilesOf(int image, const std::string& kind, bool with_cost, bool with_mask) const {
  std::vector<fs::path> paths;
  if (IsCompact(image, kind)) {
    paths.push_back(CompactMapPath(workspace_, image, kind));
  } else {
    paths = {workspace_.DepthMapPath(image, kind), workspace_.NormalMapPath(image, kind)};
    if (with_mask) paths.push_back(workspace_.FilledMaskPath(image, kind));
  }
  if (with_cost) paths.push_back(workspace_.CostMapPath(image, kind));
  return paths;
}

void MapStore::RemoveOthers(int image, const std::string& kind, const CompleteFiles& files) const {
  for (const fs::path& path : ResultPaths(workspace_, image, kind)) {
    const bool is_its_own = std::any_of(files.begin(), files.end(), [&](const auto& file) { return file->path() == path; });
    std::error_code ignored;  // a file that is not there is as good as one removed
    if (!is_its_own) fs::remove(path, ignored);
  }
}

phi::Message MapStore::MapsProblem(int image, const std::string& kind) const {
  const phi::Pinhole& pinhole = workspace_.views()[image].camera.pinhole;
  if (IsCompact(image, kind)) return SizeProblem(CompactMapPath(workspace_, image, kind), pinhole, 1);
  const phi::Message problem = SizeProblem(workspace_.DepthMapPath(image, kind), pinhole, 1);
  return problem.empty() ? SizeProblem(workspace_.NormalMapPath(image, kind), pinhole, 3) : problem;
}

bool MapStore::MapsAreWhole(int image, const std::string& kind) const { return MapsProblem(image, kind).empty(); }

bool MapStore::HasMask(int image, const std::string& kind) const {
  std::error_code unreachable;
  return IsCompact(image, kind) || fs::exists(workspace_.FilledMaskPath(image, kind), unreachable);
}

void MapStore::RemoveFiles(int image, const std::string& kind) {
  confidence_.Remove(kind);
  RemoveOthers(image, kind, {});
}

}  // namespace colmap_ext

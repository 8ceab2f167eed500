#include "colmap_ext/pipeline/map_store.h"

#include <system_error>
#include <utility>

#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "phi/base/error.h"
#include "phi/filtering/few_witnesses.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

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

std::string DepthsKey(const std::string& kind) { return kind + " depths"; }
std::string CostKey(const std::string& kind) { return kind + " cost"; }
std::string MaskKey(const std::string& kind) { return kind + " mask"; }

bool HasSize(const fs::path& path, const phi::Pinhole& pinhole, int channels) {
  try {
    const MapSize size = ReadMapSize(path);
    return size.width == pinhole.width && size.height == pinhole.height && size.channels == channels;
  } catch (const phi::InputError&) {
    return false;
  }
}

}  // namespace

MapStore::MapStore(const Workspace& workspace, std::int64_t budget_bytes, int num_writers)
    : workspace_(workspace), cache_(budget_bytes), writers_(num_writers) {}

std::shared_ptr<const phi::GrayImage> MapStore::Gray(int image) {
  const auto item = cache_.GetOrLoad({image, "gray"}, [&] {
    std::shared_ptr<const phi::GrayImage> gray = workspace_.ReadGray(image);
    const auto mask = ImageMask(image);
    if (mask != nullptr) gray = std::make_shared<const phi::GrayImage>(phi::ExtendIntoMask(*gray, *mask));
    return MakeSized(gray);
  });
  return std::static_pointer_cast<const phi::GrayImage>(item);
}

std::shared_ptr<const phi::GrayImage> MapStore::CutGray(int image) {
  const auto mask = ImageMask(image);
  if (mask == nullptr) return Gray(image);
  return GetOrRead<phi::GrayImage>(cache_, {image, "cut gray"},
                                   [&] { return phi::CutOutMask(*Gray(image), *mask); });
}

std::shared_ptr<const phi::ImageMask> MapStore::ImageMask(int image) {
  const std::filesystem::path path = workspace_.ImageMaskPath(image);
  if (path.empty() || !fs::exists(path)) return nullptr;
  const auto item =
      cache_.GetOrLoad({image, "mask"}, [&] { return MakeSized(workspace_.ReadImageMask(image)); });
  return std::static_pointer_cast<const phi::ImageMask>(item);
}

std::shared_ptr<const phi::PlaneMap> MapStore::Map(int image, const std::string& kind) {
  return GetOrRead<phi::PlaneMap>(cache_, {image, kind}, [&] {
    phi::PlaneMap map = ReadPlaneMap(workspace_.DepthMapPath(image, kind), workspace_.NormalMapPath(image, kind));
    if (const auto mask = ImageMask(image); mask != nullptr) phi::DropMasked(*mask, &map);
    return map;
  });
}

std::shared_ptr<const phi::DepthMap> MapStore::Depths(int image, const std::string& kind) {
  return GetOrRead<phi::DepthMap>(cache_, {image, DepthsKey(kind)}, [&] {
    // A map that has no file yet is in memory.
    const auto map = std::static_pointer_cast<const phi::PlaneMap>(cache_.Find({image, kind}));
    phi::DepthMap depths =
        map != nullptr ? phi::DepthsOf(*map) : ReadDepthMap(workspace_.DepthMapPath(image, kind));
    if (const auto mask = ImageMask(image); mask != nullptr) phi::DropMasked(*mask, &depths);
    if (kind == kMeasured) phi::HideFewWitnesses(*MaskOf(image, kind), &depths);
    return depths;
  });
}

std::shared_ptr<const phi::CostMap> MapStore::Cost(int image, const std::string& kind) {
  return GetOrRead<phi::CostMap>(cache_, {image, CostKey(kind)},
                                 [&] { return ReadDepthMap(workspace_.CostMapPath(image, kind)); });
}

std::shared_ptr<const phi::Mask> MapStore::MaskOf(int image, const std::string& kind) {
  return GetOrRead<phi::Mask>(cache_, {image, MaskKey(kind)},
                              [&] { return ReadMask(workspace_.FilledMaskPath(image, kind)); });
}

void MapStore::Write(int image, const std::string& kind, const StageResult& result,
                     std::function<void()> on_written) {
  cache_.PutPinned({image, kind}, MakeSized(result.map));
  if (result.cost) cache_.PutPinned({image, CostKey(kind)}, MakeSized(result.cost));
  if (result.mask) cache_.PutPinned({image, MaskKey(kind)}, MakeSized(result.mask));
  writers_.Submit([this, image, kind, result, on_written = std::move(on_written)] {
    WriteFiles(image, kind, result);
    cache_.Unpin({image, kind});
    cache_.Unpin({image, CostKey(kind)});
    cache_.Unpin({image, MaskKey(kind)});
    on_written();
    // Depth and three components of the normal, float32 each: as many bytes as the map in memory.
    return static_cast<std::int64_t>(result.map->bytes() + (result.cost ? result.cost->bytes() : 0));
  });
}

void MapStore::KeepTransient(int image, const std::string& kind, const StageResult& result) {
  const auto guard = [](const std::function<void()>& write) {
    try {
      write();
    } catch (const phi::InputError& error) {
      throw phi::ResourceError(error.what());  // not the fault of the image whose turn it is
    }
  };
  cache_.PutTransient(
      {image, kind}, MakeSized(result.map), [this, image, kind, guard](const MemoryCache::Item& item) {
        guard([&] { WriteFiles(image, kind, {.map = std::static_pointer_cast<const phi::PlaneMap>(item)}); });
      });
  if (!result.mask) return;
  cache_.PutTransient(
      {image, MaskKey(kind)}, MakeSized(result.mask),
      [this, image, kind, guard](const MemoryCache::Item& item) {
        guard([&] { WriteMask(workspace_.FilledMaskPath(image, kind), *static_cast<const phi::Mask*>(item.get())); });
      });
}

void MapStore::Forget(int image, const std::string& kind) {
  for (const std::string& key : {kind, DepthsKey(kind), MaskKey(kind)}) cache_.Erase({image, key});
}

void MapStore::WriteFiles(int image, const std::string& kind, const StageResult& result) const {
  if (result.mask) WriteMask(workspace_.FilledMaskPath(image, kind), *result.mask);
  if (result.cost) WriteDepthMap(workspace_.CostMapPath(image, kind), *result.cost);
  WritePlaneMap(workspace_.DepthMapPath(image, kind), workspace_.NormalMapPath(image, kind), *result.map);
}

bool MapStore::FilesAreWhole(int image, const std::string& kind, bool with_cost, bool with_mask) const {
  const phi::Pinhole& pinhole = workspace_.views()[image].camera.pinhole;
  return HasSize(workspace_.DepthMapPath(image, kind), pinhole, 1) &&
         HasSize(workspace_.NormalMapPath(image, kind), pinhole, 3) &&
         (!with_cost || HasSize(workspace_.CostMapPath(image, kind), pinhole, 1)) &&
         (!with_mask || fs::exists(workspace_.FilledMaskPath(image, kind)));
}

void MapStore::RemoveFiles(int image, const std::string& kind) const {
  std::error_code ignored;  // a file that is not there is as good as one removed
  fs::remove(workspace_.DepthMapPath(image, kind), ignored);
  fs::remove(workspace_.NormalMapPath(image, kind), ignored);
  fs::remove(workspace_.CostMapPath(image, kind), ignored);
  fs::remove(workspace_.FilledMaskPath(image, kind), ignored);
}

}  // namespace colmap_ext

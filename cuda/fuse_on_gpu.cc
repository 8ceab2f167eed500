#include "cuda/fuse_on_gpu.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "cuda/buffer.h"
#include "cuda/device.h"
#include "cuda/fusion_kernels.h"
#include "cuda/scratch_pool.h"
#include "cuda/staging.h"
#include "cuda/stream.h"
#include "phi/base/log.h"

namespace phi::gpu {
namespace {

using HostMap = ArrayView2D<const FusionPixel>;

// Enough that the device computes while copies go both ways.
constexpr std::size_t kMaxCallsAtOnce = 8;

Task FusionTask(int width = 0, int height = 0) { return {"fusion", "", width, height}; }

// A map on the device.
struct MapCopy {
  DeviceBuffer<FusionPixel> pixels;
  std::uint64_t last_use = 0;
};

// The copies of maps, by the host's memory. Not safe for concurrent use.
class MapCopies {
 public:
  explicit MapCopies(std::int64_t budget) : budget_(budget) {}

  // Null: there is none.
  std::shared_ptr<MapCopy> Find(HostMap map) {
    const auto found = copies_.find(map.data);
    if (found == copies_.end()) return nullptr;
    found->second->last_use = ++clock_;
    return found->second;
  }

  // Room for a copy, for Add. No data where there is none beside what is in use.
  DeviceBuffer<FusionPixel> TakeMemory(HostMap map) {
    try {
      return FindMemory(map);
    } catch (const OutOfDeviceMemory& error) {
      LogDebug(error.what());
      budget_ = num_bytes_;  // other programs use the device, too
      return {};
    }
  }

  std::shared_ptr<MapCopy> Add(HostMap map, DeviceBuffer<FusionPixel> pixels) {
    auto copy = std::make_shared<MapCopy>();
    copy->pixels = std::move(pixels);
    copy->last_use = ++clock_;
    copies_[map.data] = copy;
    return copy;
  }

  // Without discarding another copy.
  bool HasRoomFor(HostMap map) const {
    return MayGrowBy(map) || std::any_of(unused_.begin(), unused_.end(), [map](const auto& memory) { return Holds(memory, map); });
  }

  void Forget(HostMap map) {
    const auto found = copies_.find(map.data);
    if (found != copies_.end()) Discard(found);
  }

 private:
  using Entry = std::map<const FusionPixel*, std::shared_ptr<MapCopy>>::iterator;

  static std::int64_t Bytes(HostMap map) { return map.size() * static_cast<std::int64_t>(sizeof(FusionPixel)); }
  static bool Holds(const DeviceBuffer<FusionPixel>& memory, HostMap map) {
    return static_cast<std::int64_t>(memory.bytes()) >= Bytes(map);
  }
  bool MayGrowBy(HostMap map) const { return num_bytes_ + Bytes(map) <= budget_; }

  // Of a map that is gone, or new. To free memory stops the device, so it goes from map to map.
  DeviceBuffer<FusionPixel> FindMemory(HostMap map) {
    for (;;) {
      const auto unused = std::find_if(unused_.begin(), unused_.end(), [map](const auto& memory) { return Holds(memory, map); });
      if (unused != unused_.end()) {
        DeviceBuffer<FusionPixel> memory = std::move(*unused);
        unused_.erase(unused);
        return memory;
      }
      if (MayGrowBy(map)) {
        DeviceBuffer<FusionPixel> memory(map.size(), FusionTask(map.width, map.height));
        num_bytes_ += static_cast<std::int64_t>(memory.bytes());
        return memory;
      }
      if (!unused_.empty()) {
        num_bytes_ -= static_cast<std::int64_t>(unused_.back().bytes());
        unused_.pop_back();
      } else if (!DiscardOldest()) {
        return {};
      }
    }
  }

  // False: all are in use.
  bool DiscardOldest() {
    Entry oldest = copies_.end();
    for (Entry entry = copies_.begin(); entry != copies_.end(); ++entry) {
      if (entry->second.use_count() > 1) continue;
      if (oldest == copies_.end() || entry->second->last_use < oldest->second->last_use) oldest = entry;
    }
    if (oldest == copies_.end()) return false;
    Discard(oldest);
    return true;
  }

  // Nobody else holds it.
  void Discard(Entry entry) {
    unused_.push_back(std::move(entry->second->pixels));
    copies_.erase(entry);
  }

  std::int64_t budget_, num_bytes_ = 0;
  std::uint64_t clock_ = 0;
  std::map<const FusionPixel*, std::shared_ptr<MapCopy>> copies_;
  std::vector<DeviceBuffer<FusionPixel>> unused_;
};

struct FusionScratch {
  explicit FusionScratch(const Task& task) : stream(task) {}
  void Settle() const { stream.Settle(); }

  Stream stream;
  DeviceBuffer<std::uint32_t> pixels;
  DeviceBuffer<PixelOutcome> outcomes;
  DeviceBuffer<std::uint8_t> is_fused, gathering;
  DeviceBuffer<FusedPixel> fused, gathered;
  DeviceBuffer<std::int32_t> num_fused;
  PinnedBuffer<PixelOutcome> host_outcomes;
  PinnedBuffer<FusedPixel> host_fused;
  PinnedBuffer<std::int32_t> host_num_fused;
};

DecidedPixels Decide(FusionLaunch launch, const std::vector<std::uint32_t>& pixels, FusionScratch* scratch) {
  const Task task = FusionTask(launch.map.width, launch.map.height);
  const cudaStream_t stream = scratch->stream.get();
  const std::int64_t count = static_cast<std::int64_t>(pixels.size());
  // Blocks differ in what they ask; memory that grows a little with each is freed as often, for which the device waits.
  const auto room = static_cast<std::int64_t>(std::bit_ceil(pixels.size()));
  scratch->pixels.Reserve(room, task);
  scratch->outcomes.Reserve(room, task);
  scratch->is_fused.Reserve(room, task);
  scratch->fused.Reserve(room, task);
  scratch->gathered.Reserve(room, task);
  scratch->host_outcomes.Reserve(room, task);
  scratch->host_fused.Reserve(room, task);
  scratch->num_fused.Reserve(1, task);
  scratch->pixels.Upload(pixels.data(), count, stream, task);
  launch.pixels = scratch->pixels.data();
  launch.num_pixels = static_cast<int>(count);
  const FusionVerdicts verdicts = {scratch->outcomes.data(), scratch->is_fused.data(), scratch->fused.data()};
  LaunchDecide(launch, verdicts, stream, task);
  LaunchGather(verdicts, launch.num_pixels, {scratch->gathered.data(), scratch->num_fused.data()}, &scratch->gathering, stream, task);
  scratch->host_num_fused.Download(scratch->num_fused, 1, stream, task);
  scratch->host_outcomes.Download(scratch->outcomes, count, stream, task);
  scratch->stream.Synchronize(task);
  const std::int64_t num_fused = *scratch->host_num_fused.data();
  if (num_fused > 0) scratch->host_fused.Download(scratch->gathered, num_fused, stream, task);
  scratch->stream.Synchronize(task);
  return {{scratch->host_outcomes.data(), scratch->host_outcomes.data() + count},
          {scratch->host_fused.data(), scratch->host_fused.data() + num_fused}};
}

// All that the device must be current for, when it goes.
struct FusionMemory {
  explicit FusionMemory(std::int64_t budget_bytes) : copies(budget_bytes) {}

  MapCopies copies;
  DeviceBuffer<FusionNeighbor> neighbors;  // of the image at hand
  StagingPool staging;
  ScratchPool<FusionScratch> scratch{kMaxCallsAtOnce};
};

class CudaFusion final : public FusionDevice {
 public:
  CudaFusion(int index, std::int64_t budget_bytes) : index_(index), memory_(std::make_unique<FusionMemory>(budget_bytes)) {}
  ~CudaFusion() override {
    const ScopedDevice current(index_);
    memory_.reset();
  }

  void Load(HostMap map) override {
    const ScopedDevice current(index_);
    std::unique_lock<std::mutex> lock(mutex_);
    if (has_failed_ || !memory_->copies.HasRoomFor(map)) return;
    try {
      GetCopy(map, [&](const DeviceBuffer<FusionPixel>& pixels) {
        lock.unlock();  // copies of several maps side by side
        Upload(map, pixels);
        lock.lock();
      });
    } catch (const ResourceError& error) {
      GiveUp(error);
    }
  }

  void Forget(HostMap map) override {
    const ScopedDevice current(index_);
    const std::lock_guard<std::mutex> lock(mutex_);
    memory_->copies.Forget(map);
  }

  std::unique_ptr<Image> Start(HostMap reference, const RayModel& rays, const std::vector<FusionNeighbor>& neighbors) override;

  DecidedPixels Decide(const FusionLaunch& launch, const std::vector<std::uint32_t>& pixels) {
    const ScopedDevice current(index_);
    const ScratchPool<FusionScratch>::Lease scratch(&memory_->scratch, FusionTask());
    try {
      return gpu::Decide(launch, pixels, scratch.get());
    } catch (...) {
      has_failed_ = true;
      throw;
    }
  }

 private:
  // Null where there is no room. The mutex must be held; fill(pixels) copies the map, and may let go of the mutex meanwhile.
  template <typename Fill>
  std::shared_ptr<MapCopy> GetCopy(HostMap map, const Fill& fill) {
    MapCopies& copies = memory_->copies;
    if (std::shared_ptr<MapCopy> copy = copies.Find(map); copy != nullptr) return copy;
    DeviceBuffer<FusionPixel> pixels = copies.TakeMemory(map);
    if (pixels.data() == nullptr) return nullptr;
    fill(pixels);
    return copies.Add(map, std::move(pixels));
  }

  void Upload(HostMap map, const DeviceBuffer<FusionPixel>& pixels) {
    memory_->staging.Upload(map.data, map.size(), pixels.data(), FusionTask(map.width, map.height));
  }

  void GiveUp(const ResourceError& error) {
    LogWarning(std::string(error.what()) + "; the processor goes on in its place");
    has_failed_ = true;
  }

  const int index_;
  std::atomic<bool> has_failed_ = false;
  std::mutex mutex_;
  std::unique_ptr<FusionMemory> memory_;
};

class ImageOnGpu final : public FusionDevice::Image {
 public:
  ImageOnGpu(CudaFusion* device, std::vector<std::shared_ptr<MapCopy>> copies, const FusionLaunch& launch)
      : device_(device), copies_(std::move(copies)), launch_(launch) {}

  DecidedPixels Decide(const FusionGates& gates, const std::vector<std::uint32_t>& pixels) override {
    FusionLaunch launch = launch_;
    launch.gates = gates;
    return device_->Decide(launch, pixels);
  }

 private:
  CudaFusion* device_;
  std::vector<std::shared_ptr<MapCopy>> copies_;  // held: the device forgets them later
  FusionLaunch launch_;
};

std::unique_ptr<FusionDevice::Image> CudaFusion::Start(HostMap reference, const RayModel& rays,
                                                       const std::vector<FusionNeighbor>& neighbors) {
  const ScopedDevice current(index_);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (has_failed_) return nullptr;
  try {
    const Task task = FusionTask(reference.width, reference.height);
    const auto copy_of = [&](HostMap map) {
      return GetCopy(map, [&](const DeviceBuffer<FusionPixel>& pixels) { Upload(map, pixels); });
    };
    std::vector<std::shared_ptr<MapCopy>> copies = {copy_of(reference)};
    std::vector<FusionNeighbor> bound = neighbors;
    for (FusionNeighbor& neighbor : bound) {
      if (copies.back() == nullptr) return nullptr;
      copies.push_back(copy_of(neighbor.map));
      if (copies.back() != nullptr) neighbor.map.data = copies.back()->pixels.data();
    }
    if (copies.back() == nullptr) return nullptr;
    const std::int64_t count = static_cast<std::int64_t>(bound.size());
    memory_->neighbors.Reserve(std::max<std::int64_t>(count, 1), task);
    memory_->staging.Upload(bound.data(), count, memory_->neighbors.data(), task);
    FusionLaunch launch;
    launch.map = copies.front()->pixels.View(reference.width, reference.height);
    launch.rays = rays;
    launch.neighbors = memory_->neighbors.data();
    launch.num_neighbors = static_cast<int>(count);
    return std::make_unique<ImageOnGpu>(this, std::move(copies), launch);
  } catch (const ResourceError& error) {
    GiveUp(error);
    return nullptr;
  }
}

}  // namespace

std::unique_ptr<FusionDevice> MakeCudaFusion(int gpu_index, std::int64_t budget_bytes) {
  const ScopedDevice current(gpu_index);
  if (budget_bytes <= 0) {
    std::size_t free = 0, total = 0;
    Check(cudaMemGetInfo(&free, &total), "cudaMemGetInfo", FusionTask());
    budget_bytes = static_cast<std::int64_t>(free / 4 * 3);  // calls need some beside maps
  }
  return std::make_unique<CudaFusion>(gpu_index, budget_bytes);
}

}  // namespace phi::gpu

#include "phi/base/array_memory.h"

#include <sys/mman.h>

#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <new>
#include <utility>

namespace phi {
namespace {

constexpr std::size_t kHugePage = std::size_t{2} << 20;  // bytes
constexpr std::size_t kMappingUnit = std::size_t{64} << 10;  // a multiple of every usual page size
// One part in so many of what large arrays take may be kept for those to come.
constexpr std::size_t kPartsInUse = 4;

std::uintptr_t RoundUp(std::uintptr_t value, std::size_t unit) { return (value + unit - 1) / unit * unit; }

void Unmap(std::uintptr_t begin, std::uintptr_t end) {
  if (begin < end) munmap(reinterpret_cast<void*>(begin), end - begin);
}

// Begins at a huge page.
void* Map(std::size_t size) {
  void* mapping = mmap(nullptr, size + kHugePage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (mapping == MAP_FAILED) return nullptr;
  const auto first = reinterpret_cast<std::uintptr_t>(mapping);
  const std::uintptr_t begin = RoundUp(first, kHugePage);
  Unmap(first, begin);
  Unmap(begin + size, first + size + kHugePage);
  void* memory = reinterpret_cast<void*>(begin);
#ifdef MADV_HUGEPAGE
  // A wish: without huge pages it is slower. The last one may be larger than what is left.
  madvise(memory, size / kHugePage * kHugePage, MADV_HUGEPAGE);
#endif
  return memory;
}

// Large arrays, and the memory of freed ones for the next array of the same size: an image's maps are as large as those of the image
// before. Thread-safe.
class LargeArrays {
 public:
  void* Allocate(std::size_t size) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      used_bytes_ += size;
      for (Kept** place = &newest_; *place != nullptr; place = &(*place)->older) {
        if ((*place)->size == size) return TakeOut(place);
      }
    }
    void* memory = Map(size);
    if (memory != nullptr) return memory;
    // Where memory is short there is none to keep.
    GiveBack(TakeOldest(0));
    memory = Map(size);
    if (memory != nullptr) return memory;
    const std::lock_guard<std::mutex> lock(mutex_);
    used_bytes_ -= size;
    return nullptr;
  }

  void Free(void* memory, std::size_t size) {
    std::size_t most = 0;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      used_bytes_ -= size;
      newest_ = ::new (memory) Kept{newest_, size};
      kept_bytes_ += size;
      most = used_bytes_ / kPartsInUse;
    }
    GiveBack(TakeOldest(most));
  }

 private:
  // Lies where the array was.
  struct Kept {
    Kept* older;
    std::size_t size;
  };

  Kept* TakeOut(Kept** place) {
    Kept* kept = *place;
    *place = kept->older;
    kept_bytes_ -= kept->size;
    return kept;
  }

  // All that is kept beyond `most` bytes, as a list.
  Kept* TakeOldest(std::size_t most) {
    const std::lock_guard<std::mutex> lock(mutex_);
    Kept* taken = nullptr;
    while (kept_bytes_ > most) {
      Kept** oldest = &newest_;
      while ((*oldest)->older != nullptr) oldest = &(*oldest)->older;
      Kept* one = TakeOut(oldest);
      one->older = std::exchange(taken, one);
    }
    return taken;
  }

  static void GiveBack(Kept* list) {
    while (list != nullptr) {
      const Kept kept = *list;
      munmap(list, kept.size);
      list = kept.older;
    }
  }

  std::mutex mutex_;
  Kept* newest_ = nullptr;
  std::size_t used_bytes_ = 0, kept_bytes_ = 0;
};

// Never destroyed: static arrays may be freed after it.
LargeArrays& Large() {
  static auto* const arrays = new LargeArrays;
  return *arrays;
}

}  // namespace

void* AllocateArray(std::size_t num_bytes, std::size_t large) {
  void* memory = num_bytes >= large ? Large().Allocate(RoundUp(num_bytes, kMappingUnit)) : std::malloc(num_bytes);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void FreeArray(void* memory, std::size_t num_bytes, std::size_t large) {
  if (num_bytes >= large) {
    Large().Free(memory, RoundUp(num_bytes, kMappingUnit));
  } else {
    std::free(memory);
  }
}

}  // namespace phi

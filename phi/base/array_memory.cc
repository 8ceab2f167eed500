#include "phi/base/array_memory.h"

#include <sys/mman.h>

#include <cstdlib>

namespace phi {
namespace {

constexpr std::size_t kHugePage = std::size_t{2} << 20;  // bytes
constexpr std::size_t kCacheLine = 64;
constexpr std::size_t kLarge = 2 * kHugePage;  // from here on; rounding up then wastes a third at most

std::size_t RoundUp(std::size_t size, std::size_t unit) { return (size + unit - 1) / unit * unit; }

}  // namespace

void* AllocateArray(std::size_t num_bytes) {
  const bool large = num_bytes >= kLarge;
  const std::size_t unit = large ? kHugePage : kCacheLine, size = RoundUp(num_bytes, unit);
  void* memory = size >= num_bytes ? std::aligned_alloc(unit, size) : nullptr;
  if (memory == nullptr) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  if (large) madvise(memory, size, MADV_HUGEPAGE);  // a wish: without huge pages it is slower
#endif
  return memory;
}

void FreeArray(void* memory) { std::free(memory); }

}  // namespace phi

#include "phi/base/array_memory.h"

#include <sys/mman.h>

#include <cstdint>
#include <cstdlib>

namespace phi {
namespace {

constexpr std::size_t kHugePage = std::size_t{2} << 20;  // bytes
constexpr std::size_t kMappingUnit = std::size_t{64} << 10;  // a multiple of every usual page size

std::uintptr_t RoundUp(std::uintptr_t value, std::size_t unit) { return (value + unit - 1) / unit * unit; }

void Unmap(std::uintptr_t begin, std::uintptr_t end) {
  if (begin < end) munmap(reinterpret_cast<void*>(begin), end - begin);
}

// Begins at a huge page.
void* Map(std::size_t num_bytes) {
  const std::size_t size = RoundUp(num_bytes, kMappingUnit);
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

}  // namespace

void* AllocateArray(std::size_t num_bytes, std::size_t large) {
  void* memory = num_bytes >= large ? Map(num_bytes) : std::malloc(num_bytes);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void FreeArray(void* memory, std::size_t num_bytes, std::size_t large) {
  if (num_bytes >= large) {
    munmap(memory, RoundUp(num_bytes, kMappingUnit));
  } else {
    std::free(memory);
  }
}

}  // namespace phi

// Memory for arrays of an image's size.
//
// Fresh memory costs more than most work on it: the kernel maps and zeroes it page by page, in the thread that touches it
// first. Large arrays therefore take huge pages where there are any, and an array that several threads will fill can be
// made without a first touch (Array2D::Uninitialized). What a freed one took is kept for the next of its size, as long as all that is kept
// is no more than a quarter of what large arrays take.
#pragma once

#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

namespace phi {

// From here on arrays get their own mapping, or that of a freed one. The heap keeps smaller ones for the next that asks, and that
// is faster than fresh memory of any kind; larger ones it never keeps. Where an array is read at random, page tables cost more
// than fresh memory.
inline constexpr std::size_t kLargeArray = (std::size_t{32} << 20) + 1;  // bytes
inline constexpr std::size_t kLargeRandomArray = std::size_t{2} << 20;

// large: the one of the two that says what the array is for, the same when it is freed. Throws std::bad_alloc.
void* AllocateArray(std::size_t num_bytes, std::size_t large = kLargeArray);
void FreeArray(void* memory, std::size_t num_bytes, std::size_t large = kLargeArray);

// For std::vector: plain elements without a value stay uninitialised.
template <typename T, std::size_t kLarge = kLargeArray>
struct ArrayAllocator {
  using value_type = T;
  template <typename U>
  struct rebind {
    using other = ArrayAllocator<U, kLarge>;
  };

  ArrayAllocator() = default;
  template <typename U>
  ArrayAllocator(const ArrayAllocator<U, kLarge>&) {}

  T* allocate(std::size_t size) { return static_cast<T*>(AllocateArray(size * sizeof(T), kLarge)); }
  void deallocate(T* memory, std::size_t size) { FreeArray(memory, size * sizeof(T), kLarge); }

  template <typename U>
  void construct(U* element) {
    if constexpr (!std::is_trivially_copyable_v<U>) ::new (static_cast<void*>(element)) U;
  }
  template <typename U, typename... Value>
  void construct(U* element, Value&&... value) {
    ::new (static_cast<void*>(element)) U(std::forward<Value>(value)...);
  }

  friend bool operator==(const ArrayAllocator&, const ArrayAllocator&) { return true; }
};

}  // namespace phi

// Memory for arrays of an image's size.
//
// Fresh memory costs more than most work on it: the kernel maps and zeroes it page by page, in the thread that touches it
// first. Large arrays therefore take huge pages where there are any, and an array that several threads will fill can be
// made without a first touch (Array2D::Uninitialized).
#pragma once

#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

namespace phi {

// Throws std::bad_alloc.
void* AllocateArray(std::size_t num_bytes);
void FreeArray(void* memory, std::size_t num_bytes);

// For std::vector: plain elements without a value stay uninitialised.
template <typename T>
struct ArrayAllocator {
  using value_type = T;

  ArrayAllocator() = default;
  template <typename U>
  ArrayAllocator(const ArrayAllocator<U>&) {}

  T* allocate(std::size_t size) { return static_cast<T*>(AllocateArray(size * sizeof(T))); }
  void deallocate(T* memory, std::size_t size) { FreeArray(memory, size * sizeof(T)); }

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

#include "phi/base/array_memory.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <new>
#include <vector>

namespace phi {
namespace {

constexpr std::size_t kSize = kLargeArray + 12345;  // bytes

bool IsMapped(void* memory) {
  unsigned char in_memory = 0;
  return mincore(memory, 1, &in_memory) == 0 || errno != ENOMEM;
}

// So many bytes in use, one array beside another.
class LargeArrays {
 public:
  explicit LargeArrays(int count) {
    for (int i = 0; i < count; ++i) arrays_.push_back(AllocateArray(kSize));
  }
  ~LargeArrays() {
    for (void* array : arrays_) FreeArray(array, kSize);
  }
  LargeArrays(const LargeArrays&) = delete;
  LargeArrays& operator=(const LargeArrays&) = delete;

 private:
  std::vector<void*> arrays_;
};

TEST(ArrayMemoryTest, AFreedArraysMemoryIsTheNextOnesOfItsSize) {
  const LargeArrays others(4);
  void* first = AllocateArray(kSize);
  FreeArray(first, kSize);
  void* larger = AllocateArray(2 * kSize);
  EXPECT_NE(larger, first);
  void* second = AllocateArray(kSize);
  EXPECT_EQ(second, first);
  std::memset(second, 1, kSize);
  FreeArray(second, kSize);
  FreeArray(larger, 2 * kSize);
}

TEST(ArrayMemoryTest, NoMoreIsKeptThanAQuarterOfWhatIsInUse) {
  const LargeArrays others(4);
  void* first = AllocateArray(kSize);
  void* second = AllocateArray(kSize);
  FreeArray(first, kSize);
  EXPECT_TRUE(IsMapped(first));
  FreeArray(second, kSize);
  EXPECT_NE(IsMapped(first), IsMapped(second));
}

TEST(ArrayMemoryTest, WhatIsKeptGoesWithWhatIsInUse) {
  void* first = nullptr;
  {
    const LargeArrays others(4);
    first = AllocateArray(kSize);
    FreeArray(first, kSize);
    EXPECT_TRUE(IsMapped(first));
  }
  EXPECT_FALSE(IsMapped(first));
}

// The process may take half an array more than it has; what is kept makes room for another size.
TEST(ArrayMemoryTest, WhereMemoryIsShortNoneIsKept) {
  const LargeArrays others(4);
  FreeArray(AllocateArray(kSize), kSize);
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_AS, &before), 0);
  std::size_t num_pages = 0;
  std::ifstream("/proc/self/statm") >> num_pages;
  ASSERT_GT(num_pages, 0u);
  rlimit less = before;
  less.rlim_cur = num_pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + kSize / 2;
  ASSERT_EQ(setrlimit(RLIMIT_AS, &less), 0);
  void* other = nullptr;
  EXPECT_NO_THROW(other = AllocateArray(kSize + kSize / 8));
  EXPECT_THROW(AllocateArray(4 * kSize), std::bad_alloc);
  ASSERT_EQ(setrlimit(RLIMIT_AS, &before), 0);
  if (other != nullptr) FreeArray(other, kSize + kSize / 8);
}

}  // namespace
}  // namespace phi

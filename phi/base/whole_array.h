// Loops over whole arrays of an image's size by all threads. Fresh memory is touched first by those that write it.
// Functions of an element are best lambdas: a function's name is called for each element, a lambda becomes part of the loop.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include "phi/base/array2d.h"

namespace phi {

inline constexpr std::size_t kWholeArrayGrain = std::size_t{1} << 16;  // elements: enough to be worth a task

// Calls function(begin, end) for parts of [0, size).
template <typename Function>
void ForParts(std::size_t size, const Function& function) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size, kWholeArrayGrain),
                    [&](const auto& part) { function(part.begin(), part.end()); });
}

// The same for rows of an image: where there are more cores than images, one image would be waited for.
template <typename Function>
void ForRows(int height, const Function& function) {
  constexpr int kLeastRows = 64;
  tbb::parallel_for(tbb::blocked_range<int>(0, height, kLeastRows), [&](const auto& rows) { function(rows.begin(), rows.end()); });
}

template <typename T>
void CopyAll(const T* from, std::size_t size, T* to) {
  ForParts(size,
           [&](std::size_t begin, std::size_t end) { std::copy(from + begin, from + end, to + begin); });
}

// function(element) for each.
template <typename T, typename Function>
auto Transformed(const Array2D<T>& array, const Function& function) {
  auto result = Array2D<decltype(function(array.data()[0]))>::Uninitialized(array.width(), array.height());
  ForParts(array.size(), [&](std::size_t begin, std::size_t end) {
    std::transform(array.data() + begin, array.data() + end, result.data() + begin, function);
  });
  return result;
}

template <typename T, typename Predicate>
std::int64_t CountIf(const Array2D<T>& array, const Predicate& predicate) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, array.size(), kWholeArrayGrain), std::int64_t{0},
      [&](const auto& part, std::int64_t count) {
        // So many fit a byte: as many are counted by one instruction as it holds bytes.
        constexpr std::size_t kPiece = std::numeric_limits<std::uint8_t>::max();
        for (std::size_t begin = part.begin(); begin < part.end(); begin += kPiece) {
          const T *of_piece = array.data() + begin, *end = array.data() + std::min(begin + kPiece, part.end());
          std::uint8_t in_piece = 0;
          for (; of_piece != end; ++of_piece) in_piece = static_cast<std::uint8_t>(in_piece + (predicate(*of_piece) ? 1 : 0));
          count += in_piece;
        }
        return count;
      },
      std::plus<>());
}

}  // namespace phi

// A short hash of everything that a result depends on. Equal keys: the result need not be made again.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace colmap_ext {

class ResultKey {
 public:
  ResultKey& Add(std::string_view text);
  ResultKey& Add(double value);
  ResultKey& Add(std::int64_t value);
  std::string Hex() const;  // 16 digits

 private:
  void AddBytes(const void* data, std::size_t num_bytes);
  std::uint64_t hash_ = 14695981039346656037u;  // FNV-1a, 64 bits
};

}  // namespace colmap_ext

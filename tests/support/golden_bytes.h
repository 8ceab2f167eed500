// Spells out the bytes of a little-endian file, field by field.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

namespace test_support {

class GoldenBytes {
 public:
  template <typename T>
  GoldenBytes& Add(T value) {
    static_assert(std::is_arithmetic_v<T>);
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    bytes_.append(bytes, sizeof(T));
    return *this;
  }
  GoldenBytes& U8(std::uint8_t v) { return Add(v); }
  GoldenBytes& U32(std::uint32_t v) { return Add(v); }
  GoldenBytes& U64(std::uint64_t v) { return Add(v); }
  GoldenBytes& F32(float v) { return Add(v); }
  GoldenBytes& F64(double v) { return Add(v); }
  GoldenBytes& Text(const std::string& text) {
    bytes_ += text;
    return *this;
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace test_support

#include "colmap_ext/pipeline/result_key.h"

#include <cstdio>

namespace colmap_ext {

ResultKey& ResultKey::Add(std::string_view text) {
  Add(static_cast<std::int64_t>(text.size()));  // so that "ab", "c" and "a", "bc" differ
  AddBytes(text.data(), text.size());
  return *this;
}

ResultKey& ResultKey::Add(double value) {
  AddBytes(&value, sizeof(value));
  return *this;
}

ResultKey& ResultKey::Add(std::int64_t value) {
  AddBytes(&value, sizeof(value));
  return *this;
}

std::string ResultKey::Hex() const {
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(hash_));
  return text;
}

void ResultKey::AddBytes(const void* data, std::size_t num_bytes) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < num_bytes; ++i) hash_ = (hash_ ^ bytes[i]) * 1099511628211u;
}

}  // namespace colmap_ext

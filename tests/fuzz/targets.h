// Every reader of files as a function of bytes. Whatever the bytes are, it may refuse them with a phi::Error and must do
// nothing else.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace fuzz {

using Bytes = std::span<const std::uint8_t>;

struct Target {
  const char* name;
  void (*run)(Bytes bytes);
  // Small valid files, made by the program's own writers, to start from.
  std::vector<std::string> (*seeds)();
};

std::span<const Target> Targets();
// Null when there is none of this name.
const Target* FindTarget(const std::string& name);

}  // namespace fuzz

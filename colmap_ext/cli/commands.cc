#include <algorithm>
#include <array>

#include "colmap_ext/cli/command.h"

namespace colmap_ext {
namespace {

// In the order in which a user meets them.
constexpr std::array<Command, 0> kCommands = {};

}  // namespace

std::span<const Command> Commands() { return kCommands; }

const Command* FindCommand(std::string_view name) {
  const auto commands = Commands();
  const auto it =
      std::find_if(commands.begin(), commands.end(), [&](const Command& c) { return c.name == name; });
  return it == commands.end() ? nullptr : &*it;
}

}  // namespace colmap_ext

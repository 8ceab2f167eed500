#include <algorithm>

#include "colmap_ext/cli/command.h"

namespace colmap_ext {
namespace {

// In the order in which a user meets them.
constexpr Command kCommands[] = {
    {"dense", "from an undistorted workspace to a cloud and a report", RunDense},
    {"patch_match_stereo", "depth and normal maps of an undistorted workspace", RunPatchMatchStereo},
    {"hole_filler", "fill the holes of depth maps that you have, COLMAP's too", RunHoleFiller},
    {"stereo_fusion", "one coloured point cloud of depth and normal maps", RunStereoFusion},
    {"status", "images done, failed and waiting, while a run or a cluster works", RunStatusCommand},
    {"workspace_checker", "every problem of a workspace at once", RunWorkspaceChecker},
    {"evaluate", "accuracy, completeness and F1 of a cloud or of maps against the truth", RunEvaluate},
    {"make_scene", "render a synthetic room with exact depth and normal maps", RunMakeScene},
    {"report", "one self-contained HTML page about a workspace", RunReport},
    {"map_inspector", "colour pictures and statistics of depth, normal, cost and confidence maps", RunMapInspector},
    {"self_test", "compare every GPU of this machine with the CPU", RunSelfTest},
};

}  // namespace

std::span<const Command> Commands() { return kCommands; }

const Command* FindCommand(std::string_view name) {
  const auto commands = Commands();
  const auto it =
      std::find_if(commands.begin(), commands.end(), [&](const Command& c) { return c.name == name; });
  return it == commands.end() ? nullptr : &*it;
}

}  // namespace colmap_ext

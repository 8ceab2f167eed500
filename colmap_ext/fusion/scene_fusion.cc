#include "colmap_ext/fusion/scene_fusion.h"

#include <string>

#include "colmap_ext/fusion/scene_fuser.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// What the maps of all images take when fusion holds them.
std::int64_t FusedBytes(const Workspace& workspace, const HandedMaps& handed) {
  std::int64_t num_bytes = 0;
  for (std::size_t i = 0; i < workspace.views().size(); ++i) {
    const phi::Pinhole& size = workspace.views()[i].camera.pinhole;
    const auto map = handed[static_cast<int>(i)].map;
    const auto num_pixels = map != nullptr ? static_cast<std::int64_t>(map->size()) : std::int64_t{size.width} * size.height;
    num_bytes += FusionMapReader::ResidentBytes(num_pixels);
  }
  return num_bytes;
}

}  // namespace

SceneFusionReport FuseScene(const Workspace& workspace, const FusionMapSource& maps,
                            const SceneFusionOptions& options, CloudWriter* writer) {
  return OnFusionThreads(options, [&] {
    SceneFuser fuser(workspace, maps, options);
    fuser.Fuse(OrderOf(fuser.parts()), writer);
    return fuser.MakeReport(fuser.TakeFindings());
  });
}

SceneFusionReport FuseScene(const Workspace& workspace, const SceneFusionOptions& options,
                            CloudWriter* writer) {
  return FuseScene(workspace, FusionMapReader(workspace, options.input), options, writer);
}

SceneFusionReport FuseScene(const Workspace& workspace, HandedMaps* handed, const SceneFusionOptions& options,
                            CloudWriter* writer) {
  if (handed->kind() != options.input.kind) *handed = HandedMaps(options.input.kind, workspace.views().size());
  handed->Trim(options.MemoryBytes() - FusedBytes(workspace, *handed));
  phi::LogDebug("fusion: " + std::to_string(handed->num_maps()) + " maps come from memory");
  return FuseScene(workspace, FusionMapReader(workspace, options.input, handed), options, writer);
}

}  // namespace colmap_ext

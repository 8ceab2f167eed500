#include "colmap_ext/fusion/scene_fusion.h"

#include "colmap_ext/fusion/scene_fuser.h"

namespace colmap_ext {

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

}  // namespace colmap_ext

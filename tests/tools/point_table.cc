// point_table WORKSPACE STRIDE OUTPUT
//
// The table that scripts/fit_point_confidence fits the model of phi/fusion/point_confidence.h to. Fuses the workspace's maps; of every
// STRIDE-th point x y z, the distance from the nearest camera that agrees, and the terms; little-endian floats, row by row.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <vector>

#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/workspace.h"

namespace {

class TableWriter : public colmap_ext::CloudWriter {
 public:
  TableWriter(const colmap_ext::Workspace& workspace, std::size_t stride, const std::filesystem::path& path)
      : workspace_(workspace), stride_(stride), file_(path, std::ios::binary) {}

  void Write(phi::FusedBlock block) override {
    const std::uint32_t* views = block.views.data();
    for (std::size_t i = 0; i < block.points.size(); views += block.view_counts[i++]) {
      if (num_points_++ % stride_ != 0) continue;
      const Eigen::Vector3d x(block.points[i].xyz);
      double distance = std::numeric_limits<double>::infinity();
      for (std::uint32_t k = 0; k < block.view_counts[i]; ++k) {
        const phi::Pose& pose = workspace_.views()[views[k]].camera.pose;
        distance = std::min(distance, (pose.rotation * x + pose.translation).norm());
      }
      const float place[] = {static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2]), static_cast<float>(distance)};
      Put(place, sizeof(place));
      Put(block.terms[i].data(), sizeof(block.terms[i]));
    }
  }
  void Commit() override { file_.flush(); }
  bool is_good() const { return file_.good(); }

 private:
  void Put(const void* data, std::size_t num_bytes) {
    file_.write(static_cast<const char*>(data), static_cast<std::streamsize>(num_bytes));
  }

  const colmap_ext::Workspace& workspace_;
  std::size_t stride_, num_points_ = 0;
  std::ofstream file_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("usage: point_table WORKSPACE STRIDE OUTPUT\n", stderr);
    return 2;
  }
  try {
    const colmap_ext::Workspace workspace({.path = argv[1]});
    TableWriter writer(workspace, static_cast<std::size_t>(std::max(1, std::atoi(argv[2]))), argv[3]);
    colmap_ext::SceneFusionOptions options;
    options.rule.keeps_terms = true;
    options.backend = colmap_ext::FusionBackend::kCpu;
    options.scratch_folder = std::filesystem::temp_directory_path();
    FuseScene(workspace, options, &writer);
    writer.Commit();
    return writer.is_good() ? 0 : 3;
  } catch (const std::exception& error) {  // threads that cannot be made, too
    std::fprintf(stderr, "point_table: %s\n", error.what());
    return 1;
  }
}

#include "tests/support/noise_workspace.h"

#include "colmap_ext/image_file.h"
#include "colmap_ext/pipeline/result_key.h"
#include "colmap_ext/sparse_model.h"
#include "phi/base/random.h"
#include "tests/support/run_on_workspace.h"
#include "tests/support/temporary_folder.h"

namespace test_support {
namespace {

namespace fs = std::filesystem;

constexpr double kFocal = 20, kDepth = 4, kBaseline = 0.3;

colmap_ext::SparseModel MakeModel(const NoiseWorkspaceOptions& options,
                                  const std::vector<std::string>& names) {
  colmap_ext::SparseModel model;
  model.cameras[1] = {.camera_id = 1,
                      .model_id = 1,
                      .width = static_cast<std::uint64_t>(options.width),
                      .height = static_cast<std::uint64_t>(options.height),
                      .params = {kFocal, kFocal, options.width / 2.0, options.height / 2.0}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    colmap_ext::SparseImage image;
    image.image_id = static_cast<std::uint32_t>(10 + i);
    image.camera_id = 1;
    image.name = names[i];
    image.translation.x() = -kBaseline * static_cast<double>(i);  // the camera is at x = kBaseline * i
    model.images.push_back(image);
  }
  for (int p = 0; p < 60; ++p) {
    colmap_ext::SparsePoint point;
    point.point3D_id = static_cast<std::uint64_t>(p + 1);
    point.xyz = {kBaseline * (p % 10) * 0.5, 0.3 * (p / 10 - 3), kDepth + 0.1 * (p % 7)};
    point.error = 0.5;
    for (colmap_ext::SparseImage& image : model.images) {
      const Eigen::Vector3d in_camera = point.xyz + image.translation;
      const double u = kFocal * in_camera.x() / in_camera.z() + options.width / 2.0;
      const double v = kFocal * in_camera.y() / in_camera.z() + options.height / 2.0;
      if (u < 0 || v < 0 || u >= options.width || v >= options.height) continue;
      point.track.push_back({image.image_id, static_cast<std::uint32_t>(image.observations.size())});
      image.observations.push_back({u, v, point.point3D_id});
    }
    if (point.track.size() >= 2) model.points.push_back(point);
  }
  return model;
}

}  // namespace

std::vector<std::string> WriteNoiseWorkspace(const fs::path& folder, const NoiseWorkspaceOptions& options) {
  std::vector<std::string> names;
  for (int i = 0; i < options.num_images; ++i) {
    names.push_back("a/" + std::to_string(i) + ".png");
    phi::GrayImage image(options.width, options.height);
    for (std::size_t p = 0; p < image.size(); ++p) {
      image.data()[p] =
          static_cast<std::uint8_t>(phi::Philox({7, static_cast<std::uint32_t>(i)}, p, 0, 0).v[0]);
    }
    fs::create_directories((folder / "images" / names.back()).parent_path());
    colmap_ext::WriteGrayImage(folder / "images" / names.back(), image);
  }
  fs::create_directories(folder / "sparse");
  fs::create_directories(folder / "stereo");
  colmap_ext::WriteSparseModelBinary(MakeModel(options, names), folder / "sparse");
  std::string config;
  for (const std::string& name : names) config += name + "\n__all__\n";
  WriteBytes(folder / "stereo" / "patch-match.cfg", config);
  return names;
}

void ReadNeighboursAlone(const fs::path& folder, const std::vector<std::string>& names) {
  std::string config;
  for (std::size_t i = 0; i < names.size(); ++i) config += names[i] + "\n" + names[i == 0 ? 1 : i - 1] + "\n";
  WriteBytes(folder / "stereo" / "patch-match.cfg", config);
}

std::vector<std::string> HashMaps(const fs::path& folder) {
  std::vector<std::string> lines;
  for (const auto& [path, bytes] : ReadMaps(folder)) lines.push_back(path + ": " + colmap_ext::ResultKey().Add(bytes).Hex());
  return lines;
}

}  // namespace test_support

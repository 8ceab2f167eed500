// phimvs make_scene: renders a synthetic room as a COLMAP workspace with exact depth and normal maps.
#include <chrono>
#include <filesystem>
#include <string>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/synthetic/room.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {

int RunMakeScene(int argc, char** argv) {
  SyntheticRoomOptions options;
  std::filesystem::path output_path;
  OptionParser parser(
      "make_scene",
      "Render a synthetic room: DIR/dense is a COLMAP workspace, DIR/truth holds the exact maps");
  parser.Add("output_path", &output_path, "Folder DIR to write to").Required();
  parser.Add("width", &options.width, "Width of the images").Unit("pixels");
  parser.Add("height", &options.height, "Height of the images").Unit("pixels");
  parser.Add("num_views", &options.num_views, "Number of images");
  parser.Add("texture_share", &options.texture_share,
             "Share of all pixels that see texture; the others see paint");
  parser.Add("noise_sigma", &options.noise_sigma, "Standard deviation of the images' noise")
      .Unit("grey levels");
  parser.Add("exposure_jitter", &options.exposure_jitter,
             "Each image's brightness is scaled by 1 +- this at most");
  parser.Add("jpeg_quality", &options.jpeg_quality, "Quality of the JPEG files; 0 writes PNG")
      .Unit("percent");
  if (!parser.Parse(argc, argv)) return 0;
  options.seed = parser.random_seed();

  const auto start = std::chrono::steady_clock::now();
  const SyntheticRoom room = MakeSyntheticRoom(options);
  WriteSyntheticRoom(room, output_path);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  phi::LogInfo("wrote " + std::to_string(room.scene.views.size()) + " images and " +
               std::to_string(room.model.points.size()) + " sparse points to " +
               (output_path / "dense").string() + ", exact maps to " + (output_path / "truth").string() +
               " in " + FormatText("%.1f s", elapsed.count()));
  return 0;
}

}  // namespace colmap_ext

// phimvs map_inspector: colour pictures and statistics of depth, normal, cost and confidence maps, beside the truth where it is known.
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <string>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/colorize.h"
#include "colmap_ext/folder_files.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/map_statistics.h"
#include "colmap_ext/measurement_file.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

enum class MapType { kAuto, kDepth, kNormal, kCost, kConfidence };

struct InspectorOptions {
  fs::path input_path, output_path, truth_path;
  MapType map_type = MapType::kAuto;
  std::string map_kind = "geometric";
  double max_relative_depth_error = 0.01;
  double max_normal_error = 10;  // degrees
};

// A map, its picture's file and the exact map; the last two may be empty.
struct Inspection {
  fs::path map, picture, truth;
};

MapType TypeOf(const fs::path& path, MapType asked) {
  if (asked != MapType::kAuto) return asked;
  if (ReadMapSize(path).channels == 3) return MapType::kNormal;
  for (const fs::path& part : path) {
    if (part == "cost_maps") return MapType::kCost;
    if (part == "confidence_maps") return MapType::kConfidence;
  }
  return MapType::kDepth;
}

// Prints the statistics, writes the picture, and compares with the truth. Empty where there is no truth.
using Accuracy = std::optional<MapAccuracy>;

void PrintStatistics(const fs::path& path, const MapStatistics& s, const char* quantity) {
  std::cout << path.string()
            << FormatText(": valid %.1f %%, %s median %.4g, 2nd to 98th percentile %.4g to %.4g\n",
                      s.ValidPercent(), quantity, s.median, s.low, s.high);
}

void WritePicture(const fs::path& path, const ColorImage& map, const std::optional<ColorImage>& truth) {
  if (!path.empty()) WriteColorImage(path, truth ? SideBySide(map, *truth) : map);
}

Accuracy InspectDepth(const Inspection& files, const InspectorOptions& options) {
  const phi::Array2D<float> depth = ReadPublishedDepths(files.map);
  PrintStatistics(files.map, DepthStatistics(depth), "depth");
  if (files.truth.empty()) {
    WritePicture(files.picture, ColorizeDepth(depth, RobustRange(depth)), {});
    return {};
  }
  const phi::Array2D<float> truth = ReadDepthMap(files.truth);
  const ValueRange range = RobustRange(truth);
  WritePicture(files.picture, ColorizeDepth(depth, range), ColorizeDepth(truth, range));
  return CompareDepth(depth, truth, options.max_relative_depth_error);
}

Accuracy InspectNormals(const Inspection& files, const InspectorOptions& options) {
  const phi::Array2D<phi::Vec3f> normals = ReadNormalMap(files.map);
  PrintStatistics(files.map, NormalStatistics(normals), "degrees off the camera's axis");
  if (files.truth.empty()) {
    WritePicture(files.picture, ColorizeNormals(normals), {});
    return {};
  }
  const phi::Array2D<phi::Vec3f> truth = ReadNormalMap(files.truth);
  WritePicture(files.picture, ColorizeNormals(normals), ColorizeNormals(truth));
  return CompareNormals(normals, truth, options.max_normal_error);
}

Accuracy InspectCost(const Inspection& files) {
  if (!files.truth.empty()) throw phi::UsageError("a cost map has no truth: leave out --truth_path");
  const phi::Array2D<float> cost = ReadDepthMap(files.map);
  PrintStatistics(files.map, CostStatistics(cost), "cost");
  WritePicture(files.picture, ColorizeCost(cost), {});
  return {};
}

Accuracy InspectConfidence(const Inspection& files) {
  if (!files.truth.empty()) throw phi::UsageError("a confidence map has no truth: leave out --truth_path");
  const phi::Array2D<float> confidence = ReadDepthMap(files.map);
  PrintStatistics(files.map, DepthStatistics(confidence), "confidence");
  WritePicture(files.picture, ColorizeConfidence(confidence), {});
  return {};
}

// "a/b.jpg.geometric.bin" -> "a/b.jpg", or nothing when the file is of another kind.
std::optional<std::string> ImageName(const std::string& file, const std::string& kind) {
  const std::string suffix = "." + kind + ".bin";
  if (file.size() <= suffix.size() || file.compare(file.size() - suffix.size(), suffix.size(), suffix) != 0)
    return {};
  return file.substr(0, file.size() - suffix.size());
}

std::map<std::string, Inspection> FindMaps(const InspectorOptions& options) {
  std::map<std::string, Inspection> found;  // by image name
  for (const fs::path& file : FilesBelow(options.input_path, HiddenFiles::kIncluded)) {
    const auto name = ImageName(file.generic_string(), options.map_kind);
    if (!name) continue;
    Inspection& files = found[*name];
    files.map = options.input_path / file;
    if (!options.output_path.empty())
      files.picture = options.output_path / (*name + "." + options.map_kind + ".png");
    if (!options.truth_path.empty()) files.truth = options.truth_path / (*name + ".bin");
  }
  if (found.empty()) {
    throw phi::InputError(phi::AboutFile(options.input_path) + " holds no <image>." + options.map_kind +
                          ".bin; choose another folder or --map_kind. Maps in stereo/compact_maps can be had as .bin: "
                          "patch_match_stereo again, with --PhiStereo.compact_maps false");
  }
  return found;
}

Accuracy Inspect(MapType type, const Inspection& files, const InspectorOptions& options) {
  return type == MapType::kDepth    ? InspectDepth(files, options)
         : type == MapType::kNormal ? InspectNormals(files, options)
         : type == MapType::kCost   ? InspectCost(files)
                                    : InspectConfidence(files);
}

std::map<std::string, Inspection> ListMaps(const InspectorOptions& options) {
  if (fs::is_directory(options.input_path)) return FindMaps(options);
  return {{"", {options.input_path, options.output_path, options.truth_path}}};
}

void PrintAccuracy(const MapAccuracy& accuracy, MapType type, const InspectorOptions& options) {
  const std::string limit = type == MapType::kNormal
                                ? FormatText("%g degrees", options.max_normal_error)
                                : FormatText("%g %%", 100 * options.max_relative_depth_error);
  std::cout << FormatText("accuracy: kept %.1f %% of pixels, %.1f %% of them within ", accuracy.KeptPercent(),
                      accuracy.WithinPercent())
            << limit << std::endl;
}

void AddOptions(OptionParser* parser, InspectorOptions* o) {
  parser->Add("input_path", &o->input_path, "Map file (.bin), or a folder of maps such as stereo/depth_maps")
      .Required();
  parser->Add("output_path", &o->output_path,
              "Picture to write (.png), or a folder for them; empty writes none");
  parser->Add("truth_path", &o->truth_path,
              "Exact map, or a folder of <image>.bin: shown at the right and compared with");
  parser->AddChoice("map_type", &o->map_type,
                    {{"auto", MapType::kAuto},
                     {"depth", MapType::kDepth},
                     {"normal", MapType::kNormal},
                     {"cost", MapType::kCost},
                     {"confidence", MapType::kConfidence}},
                    "What the maps hold; auto goes by the channels and by a folder named cost_maps or confidence_maps");
  parser->Add("map_kind", &o->map_kind, "Which maps of a folder: photometric, measured or geometric");
  parser->Add("max_relative_depth_error", &o->max_relative_depth_error,
              "Error that counts as accurate, of the depth");
  parser->Add("max_normal_error", &o->max_normal_error, "Error that counts as accurate").Unit("degrees");
}

}  // namespace

int RunMapInspector(int argc, char** argv) {
  InspectorOptions options;
  OptionParser parser("map_inspector", "Colour pictures and statistics of depth, normal, cost and confidence maps");
  AddOptions(&parser, &options);
  if (!parser.Parse(argc, argv)) return 0;

  MapAccuracy total;
  MapType type = options.map_type;
  bool has_truth = false;
  std::size_t num_failed = 0;
  const auto maps = ListMaps(options);
  for (const auto& [name, files] : maps) {
    phi::ThrowIfCancelled();
    try {
      type = TypeOf(files.map, options.map_type);
      const Accuracy accuracy = Inspect(type, files, options);
      if (!accuracy) continue;
      has_truth = true;
      total.Add(*accuracy);
    } catch (const phi::InputError& error) {
      if (maps.size() == 1) throw;
      ++num_failed;
      phi::LogError(error.what());
    }
  }
  if (has_truth) PrintAccuracy(total, type, options);
  if (num_failed > 0) {
    phi::LogError("map_inspector: " + std::to_string(num_failed) + " of " + std::to_string(maps.size()) +
                  " maps could not be shown, see above");
  }
  return static_cast<int>(phi::CodeOfFailures(num_failed, maps.size()));
}

}  // namespace colmap_ext

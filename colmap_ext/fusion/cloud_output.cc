#include "colmap_ext/fusion/cloud_output.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "colmap_ext/format_text.h"
#include "colmap_ext/fusion/cloud_coordinates.h"
#include "colmap_ext/fusion/cloud_files.h"
#include "colmap_ext/fusion/tile_list.h"
#include "colmap_ext/input_file.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

std::string ReadCrs(const std::string& text) {
  std::string wkt = text;
  if (std::ifstream file = OpenRegularFile(text); file)
    wkt.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  while (!wkt.empty() && (std::isspace(static_cast<unsigned char>(wkt.back())) || wkt.back() == '\0')) wkt.pop_back();
  if (wkt.find('[') == std::string::npos) {
    throw phi::UsageError("--crs is '" + text +
                          "', but must be the WKT of a coordinate system or a file that holds it; "
                          "`gdalsrsinfo -o wkt1 EPSG:25832` prints that of a code");
  }
  if (wkt.size() > kMaxCrsBytes) throw phi::UsageError("--crs: the WKT is longer than a LAS file can hold");
  return wkt;
}

std::unique_ptr<CloudWriter> MakeFileWriter(const CloudOutput& output, const CloudCoordinates& coordinates,
                                            const std::filesystem::path& path, std::shared_ptr<WriteQueues> queues) {
  if (output.type == CloudType::kLas) {
    return MakeLasCloudWriter(
        {.path = path, .scale = coordinates.las_scale, .offset = coordinates.offset, .crs = output.crs, .queues = std::move(queues)});
  }
  return MakePlyCloudWriter(
      {.path = path, .offset = coordinates.offset, .in_doubles = coordinates.in_doubles, .queues = std::move(queues)});
}

// Such as a size in another unit than the model's: a disk may take hours to fill with tiles of a point each.
void WarnOfManyTiles(const Workspace& workspace, double tile_size) {
  constexpr std::size_t kMany = 10000;
  std::set<std::array<double, 2>> tiles;
  for (const SparsePoint& point : workspace.model().points) {
    tiles.insert({std::floor(point.xyz.x() / tile_size), std::floor(point.xyz.y() / tile_size)});
    if (tiles.size() <= kMany) continue;
    phi::LogWarning("--tile_size " + FormatText("%g", tile_size) + ": the sparse points alone lie on more than " + std::to_string(kMany) +
                    " tiles, which are a file each; is it in the sparse model's units?");
    return;
  }
}

}  // namespace

phi::OptionList CloudOutput::List() {
  phi::OptionList list;
  list.AddChoice<CloudType>("output_type", &type,
                            {{"auto", CloudType::kBySuffix},
                             {"PLY", CloudType::kPly},
                             {"LAS", CloudType::kLas},
                             {"BIN", CloudType::kBinary},
                             {"TXT", CloudType::kText}},
                            "Format; auto = by the suffix; BIN and TXT = COLMAP's sparse model with the cloud as its points");
  list.Add("crs", &crs, "Coordinate system of the world for LAS: WKT, or a file that holds it");
  list.Add("tile_size", &tile_size, "Side of square tiles along x and y, a file each and an index; 0 = one file")
      .Unit("world units")
      .AtLeast(0);
  return list;
}

void CloudOutput::Resolve() {
  const std::string suffix = Lowercase(path.extension().string());
  const CloudType by_suffix = suffix == ".las" ? CloudType::kLas : CloudType::kPly;
  const bool is_known = suffix == ".las" || suffix == ".ply" || suffix.empty();
  if (type == CloudType::kBySuffix) type = by_suffix;
  const bool fits = is_known && (suffix.empty() || type == by_suffix);
  if (IsFile() && !fits) {
    throw phi::UsageError("--output_path " + phi::AboutFile(path) + ": there is no writer of " +
                          (is_known ? "that --output_type" : "clouds") + " for '" + suffix +
                          "'; name the file .ply or .las");
  }
  if (!crs.empty() && type != CloudType::kLas) phi::LogWarning("--crs has no effect: only LAS files hold it");
  if (!crs.empty()) crs = ReadCrs(crs);
  if (tile_size > 0 && !IsFile()) throw phi::UsageError("--tile_size is for PLY and LAS alone");
  if (tile_size > 0) RefuseTilesOfOtherFormat(path);
}

void RemoveOtherForm(const CloudOutput& output) {
  if (!output.IsFile()) return;
  if (output.tile_size > 0) {
    RemoveEarlierCloud(output.path);
  } else {
    RemoveListedTiles(output.path);
  }
}

std::unique_ptr<CloudWriter> MakeCloudWriter(const Workspace& workspace, const CloudOutput& output) {
  if (!output.IsFile()) {
    return MakeSparseCloudWriter(workspace.model(), output.path,
                                 output.type == CloudType::kBinary ? SparseFormat::kBinary : SparseFormat::kText);
  }
  const CloudCoordinates coordinates = ChooseCoordinates(workspace);
  if (const auto& offset = coordinates.offset; output.type == CloudType::kPly && offset != std::array<double, 3>{0, 0, 0}) {
    const std::filesystem::path written = output.tile_size > 0 ? TileListPath(output.path) : output.path;
    phi::LogInfo(written.string() + FormatText(": positions are from the offset %.17g %.17g %.17g, which headers name", offset[0],
                                               offset[1], offset[2]));
  }
  if (output.tile_size <= 0) return MakeFileWriter(output, coordinates, output.path, std::make_shared<WriteQueues>());
  WarnOfManyTiles(workspace, output.tile_size);
  return MakeTiledCloudWriter({.path = output.path, .size = output.tile_size, .origin = {0, 0}},
                              [output, coordinates, queues = MakeQueuesOfTiles()](const std::filesystem::path& path) {
                                return MakeFileWriter(output, coordinates, path, queues);
                              });
}

}  // namespace colmap_ext

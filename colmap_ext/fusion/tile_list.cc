#include "colmap_ext/fusion/tile_list.h"

#include <fstream>
#include <string>

#include "colmap_ext/fusion/cloud_files.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/json_file.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {

std::filesystem::path TileListPath(const std::filesystem::path& cloud) {
  return std::filesystem::path(cloud).replace_filename(cloud.stem().string() + ".tiles.json");
}

std::filesystem::path TilePath(const std::filesystem::path& cloud, std::int64_t column, std::int64_t row) {
  return PartOfCloud(cloud, "_" + std::to_string(column) + "_" + std::to_string(row));
}

std::vector<std::filesystem::path> ListedTiles(const std::filesystem::path& cloud) {
  const std::filesystem::path list = TileListPath(cloud);
  std::vector<std::filesystem::path> tiles;
  std::ifstream stream = OpenRegularFile(list);
  if (!stream) return tiles;
  std::string problem;
  try {
    const nlohmann::ordered_json content = ParseJson(stream);
    for (const auto& tile : content.at("tiles")) {
      const std::filesystem::path path =
          TilePath(cloud, tile.at("column").get<std::int64_t>(), tile.at("row").get<std::int64_t>());
      if (tile.at("file").get<std::string>() == path.filename().string()) tiles.push_back(path);
    }
    return tiles;
  } catch (const nlohmann::ordered_json::exception& error) {
    problem = error.what();
  } catch (const phi::InputError& error) {
    problem = error.what();
  }
  phi::LogWarning(list.string() + ": this list of tiles is damaged (" + problem + "); remove the tiles of earlier runs yourself");
  return {};
}

void RemoveListedTiles(const std::filesystem::path& cloud) {
  const std::vector<std::filesystem::path> tiles = ListedTiles(cloud);
  if (tiles.empty()) return;
  for (const std::filesystem::path& tile : tiles) RemoveEarlierPart(tile);
  RemoveEarlierPart(TileListPath(cloud));
}

}  // namespace colmap_ext

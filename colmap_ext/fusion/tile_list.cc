#include "colmap_ext/fusion/tile_list.h"

#include <fstream>
#include <set>
#include <string>

#include "colmap_ext/fusion/cloud_files.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/json_file.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// Why the list cannot be read; empty: it can, or there is none. tiles: NAME_COLUMN_ROW of any suffix that it names are added.
std::string ReadTileList(const std::filesystem::path& list, const std::filesystem::path& cloud, std::vector<std::filesystem::path>* tiles) {
  std::ifstream stream = OpenRegularFile(list);
  if (!stream) return "";
  try {
    const nlohmann::ordered_json content = ParseJson(stream);
    for (const auto& tile : content.at("tiles")) {
      const std::string file = tile.at("file").get<std::string>();
      const std::filesystem::path same_format = std::filesystem::path(cloud).replace_extension(std::filesystem::path(file).extension());
      const std::filesystem::path path =
          TilePath(same_format, tile.at("column").get<std::int64_t>(), tile.at("row").get<std::int64_t>());
      if (file == path.filename().string()) tiles->push_back(path);
    }
    return "";
  } catch (const nlohmann::ordered_json::exception& error) {
    return error.what();
  } catch (const phi::InputError& error) {
    return error.what();
  }
}

bool IsOfFormatOf(const std::filesystem::path& tile, const std::filesystem::path& cloud) {
  return tile.extension() == cloud.extension();
}

}  // namespace

std::filesystem::path TileListPath(const std::filesystem::path& cloud) {
  return std::filesystem::path(cloud).replace_filename(cloud.stem().string() + ".tiles.json");
}

std::filesystem::path NextTileListPath(const std::filesystem::path& cloud) {
  return std::filesystem::path(cloud).replace_filename(cloud.stem().string() + ".tiles.next.json");
}

std::filesystem::path TilePath(const std::filesystem::path& cloud, std::int64_t column, std::int64_t row) {
  return PartOfCloud(cloud, "_" + std::to_string(column) + "_" + std::to_string(row));
}

std::vector<std::filesystem::path> ListedTiles(const std::filesystem::path& cloud) {
  std::vector<std::filesystem::path> tiles;
  const std::string problem = ReadTileList(TileListPath(cloud), cloud, &tiles);
  if (!problem.empty()) {
    phi::LogWarning(phi::AboutFile(TileListPath(cloud)) + ": this list of tiles is damaged (" + problem +
                    "); remove the tiles of earlier runs yourself");
    return {};
  }
  std::erase_if(tiles, [&](const std::filesystem::path& tile) { return !IsOfFormatOf(tile, cloud); });
  return tiles;
}

void RefuseTilesOfOtherFormat(const std::filesystem::path& cloud) {
  std::vector<std::filesystem::path> tiles;
  for (const std::filesystem::path& list : {TileListPath(cloud), NextTileListPath(cloud)})
    ReadTileList(list, cloud, &tiles);  // a damaged list is told of when it is replaced
  for (const std::filesystem::path& tile : tiles) {
    if (IsOfFormatOf(tile, cloud) || !std::filesystem::exists(tile)) continue;
    throw phi::InputError(phi::AboutFile(TileListPath(cloud)) + " lists " + tile.filename().string() +
                          " and other tiles of another suffix than '" + cloud.extension().string() +
                          "', and names those of one suffix alone; give the new cloud another name, or remove those tiles");
  }
}

void RemoveUnlistedTiles(const std::filesystem::path& cloud) {
  std::vector<std::filesystem::path> tiles, next;
  ReadTileList(TileListPath(cloud), cloud, &tiles);
  ReadTileList(NextTileListPath(cloud), cloud, &next);
  const std::set<std::filesystem::path> listed(tiles.begin(), tiles.end());
  for (const std::filesystem::path& tile : next) {
    if (IsOfFormatOf(tile, cloud) && !listed.contains(tile)) RemoveEarlierCloud(tile);  // where it is ours: the run may not have come to it
  }
  RemoveEarlierPart(NextTileListPath(cloud));
}

void RemoveListedTiles(const std::filesystem::path& cloud) {
  RemoveUnlistedTiles(cloud);
  const std::vector<std::filesystem::path> tiles = ListedTiles(cloud);
  if (tiles.empty()) return;
  for (const std::filesystem::path& tile : tiles) RemoveEarlierPart(tile);
  RemoveEarlierPart(TileListPath(cloud));
}

}  // namespace colmap_ext

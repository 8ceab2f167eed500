// NAME.tiles.json, which lists the tiles of the cloud NAME.ply or NAME.las.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace colmap_ext {

std::filesystem::path TileListPath(const std::filesystem::path& cloud);
// The same list while its tiles get their names: who is stopped meanwhile leaves none that no list names.
std::filesystem::path NextTileListPath(const std::filesystem::path& cloud);

// The tiles that the list beside `cloud` names; none where there is no list, or one that cannot be read. Only NAME_COLUMN_ROW with the
// cloud's suffix, in its folder: a list may have been edited, and who asks may remove what it names.
std::vector<std::filesystem::path> ListedTiles(const std::filesystem::path& cloud);

// Throws phi::InputError where the list names tiles of another suffix that are there: a list of the cloud's would know them no more.
void RefuseTilesOfOtherFormat(const std::filesystem::path& cloud);

// Removes the tiles that a run which was stopped has left without a list.
void RemoveUnlistedTiles(const std::filesystem::path& cloud);

// Removes these, those of a list and then their list, by which a run that is stopped in between is made up for. A list that names
// none stays: it is another cloud's.
void RemoveListedTiles(const std::filesystem::path& cloud);

// NAME_COLUMN_ROW with the cloud's suffix.
std::filesystem::path TilePath(const std::filesystem::path& cloud, std::int64_t column, std::int64_t row);

}  // namespace colmap_ext

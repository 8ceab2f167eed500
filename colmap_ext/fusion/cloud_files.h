// Names of the files that a cloud is parted into, and how those of an earlier cloud go.
#pragma once

#include <filesystem>
#include <string>

namespace colmap_ext {

// NAME.ply with an addition: NAME_2.ply.
std::filesystem::path PartOfCloud(const std::filesystem::path& cloud, const std::string& addition);

// Removes a part that an earlier cloud left, its .vis first: what names the part is there as long as any of it. Folders stay; what
// cannot be removed is a warning.
void RemoveEarlierPart(const std::filesystem::path& part);

}  // namespace colmap_ext

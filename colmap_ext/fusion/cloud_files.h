// Names of the files that a cloud is parted into, and how those of an earlier cloud go.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace colmap_ext {

// What a LAS header of ours says that wrote it, and the byte where.
inline constexpr std::string_view kLasSystem = "phimvs";
inline constexpr std::size_t kLasSystemAt = 26;

// NAME.ply with an addition: NAME_2.ply.
std::filesystem::path PartOfCloud(const std::filesystem::path& cloud, const std::string& addition);

// Of the files that a cloud goes on in, number: from 1 on, which is NAME.ply itself.
std::filesystem::path NumberedPart(const std::filesystem::path& cloud, std::size_t number);
// A comment in the headers of those after the first: tells them from clouds that were given such a name.
std::string NumberedPartComment(const std::filesystem::path& cloud);
// The number after that of the last file from `first` on that the cloud goes on in; `first`: it does not.
std::size_t EndOfNumberedParts(const std::filesystem::path& cloud, std::size_t first);

// What follows removes files of an earlier cloud, each with its .vis; that one first: what names a file is there as long as any of it.
// Folders stay; what cannot be removed is a warning.

// The numbered files from `first` on, the last one first: a process that is killed leaves none that the next one does not find.
void RemoveNumberedParts(const std::filesystem::path& cloud, std::size_t first);
// A part, and the numbered files that it went on in.
void RemoveEarlierPart(const std::filesystem::path& part);
// The same of a cloud in one file, where it is one of ours: not everything of such a name is.
void RemoveEarlierCloud(const std::filesystem::path& cloud);

}  // namespace colmap_ext

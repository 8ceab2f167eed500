// Measurement maps in about five bytes a pixel, for maps that only the program itself reads back: stereo/compact_maps/<image>.<kind>.map.
//
// A pixel (compact_codes.h): its depth as a step of its block of 16 x 16 pixels, 16 bits, where the steps of a block are 2^k units in the
// last place of its floats and k is as small as the block's range of depths allows (a range of 1 to 5 has a relative error of 3e-5
// at most, a smooth surface hardly any); its normal on the octahedron, 12 bits an axis, exact to 0.06 degrees (with 10 bits
// four times as many pixels pass or fail the filter otherwise than before); its state. Integers alone decide on depths, so every
// machine reads the same floats. The bytes of the pixels are planes, each compressed by LZ4.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/workspace.h"
#include "phi/measurement.h"

namespace colmap_ext {

// map: rounded (RoundToCompact).
std::vector<std::uint8_t> EncodeCompactMap(const phi::MeasurementMap& map);
// Throws phi::InputError, which begins with `whose`, where the bytes are no such map or damaged.
phi::MeasurementMap DecodeCompactMap(const std::vector<std::uint8_t>& bytes, const phi::Message& whose);

std::filesystem::path CompactMapPath(const Workspace& workspace, int image, std::string_view kind);
std::unique_ptr<AtomicFile> PrepareCompactMap(const std::filesystem::path& path, const phi::MeasurementMap& map,
                                              Durability durability = Durability::kPowerCut);
// Throw phi::InputError naming the file when it is missing or damaged.
phi::MeasurementMap ReadCompactMap(const std::filesystem::path& path);
// What ReadPublishedDepths reads of the same map as a COLMAP one; without reading its normals, or finding damage that is
// in them alone. See ReadDepthRows.
DepthRows ReadCompactDepthRows(const std::filesystem::path& path, int max_rows);
// From the header alone, checked against the file's length; one channel.
MapSize ReadCompactMapSize(const std::filesystem::path& path);

}  // namespace colmap_ext

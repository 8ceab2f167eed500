// Measurement maps on the disk: a compact map (compact_map.h), or a depth map, a normal map, and a mask in stereo/filled_masks
// that says what their pixels are.
//   <image>.measured.png: 128 = clue, 0 = measured or empty; earlier versions' 255 = measured.
//   <image>.png, of the geometric map: 255 = inferred, 0 = measured or empty; of what inference hands to the last filter also
//   128 = inferred, and no view confirms it.
// Earlier versions marked clues by negative depths in the measured map; they are read as what they are.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "colmap_ext/map_file.h"
#include "colmap_ext/workspace.h"
#include "phi/base/images.h"
#include "phi/measurement.h"

namespace colmap_ext {

// The mask that goes with a map.
phi::Mask MaskOfStates(const phi::StateMap& states);

// In its own files or a compact one, whole or not.
bool HasMap(const Workspace& workspace, int image, std::string_view kind);

// A map of kind `kind`; without states where it is an estimate, which has no mask. Throws phi::InputError naming the file that is
// missing, damaged or not of the others' size.
phi::MeasurementMap ReadMeasurements(const Workspace& workspace, int image, std::string_view kind);
// Of the same map, without its normals.
phi::MeasuredDepths ReadMeasuredDepths(const Workspace& workspace, int image, std::string_view kind);

// The depth map for all who take depths > 0 for depths: without what the mask beside a measured map calls clues.
phi::DepthMap ReadPublishedDepths(const std::filesystem::path& depth_path);
// Rows of the same of a workspace's map, compact or not; none where it is not there.
std::optional<DepthRows> FindPublishedDepths(const Workspace& workspace, int image, std::string_view kind, int max_rows = kAllRows);

// The value of a clue in <image>.measured.png.
inline constexpr std::uint8_t kClueValue = 128;

}  // namespace colmap_ext

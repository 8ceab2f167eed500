#include "colmap_ext/measurement_file.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <system_error>
#include <utility>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/thinning.h"
#include "phi/base/error.h"
#include "phi/base/whole_array.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using phi::PixelState;

constexpr std::uint8_t kMarkedValue = 255;

bool HasStates(std::string_view kind) { return kind == kMeasured || kind == kInferred; }

std::uint8_t ValueOf(PixelState state) {
  switch (state) {
    case PixelState::kNone:
    case PixelState::kMeasured:
      return 0;
    case PixelState::kClue:
    case PixelState::kInferredAlone:
      return kClueValue;
    case PixelState::kInferredConfirmed:
      return kMarkedValue;
  }
  return 0;
}

// Of a pixel whose depth file holds `depth`.
PixelState StateOf(std::string_view kind, std::uint8_t value, float depth) {
  const bool is_measured = kind == kMeasured;
  if (is_measured && depth < 0) return PixelState::kClue;  // an earlier version's
  if (!(depth > 0)) return PixelState::kNone;
  if (value == 0) return PixelState::kMeasured;
  if (is_measured) return value == kClueValue ? PixelState::kClue : PixelState::kMeasured;
  return value == kMarkedValue ? PixelState::kInferredConfirmed : PixelState::kInferredAlone;
}

// Fills `states` from the mask of the map whose pixel i has depth(i), and makes the depths positive.
template <typename Depth>
phi::StateMap ReadStates(const Workspace& workspace, int image, std::string_view kind, int width, int height,
                         const Depth& depth) {
  const fs::path path = workspace.FilledMaskPath(image, kind);
  const phi::Mask mask = ReadMask(path);
  if (mask.width() != width || mask.height() != height) {
    throw phi::InputError(phi::AboutFile(path) +
                          ": this mask has not the size of its map; delete it and compute it again");
  }
  auto states = phi::StateMap::Uninitialized(width, height);
  phi::ForParts(states.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      float& d = depth(i);
      states.data()[i] = StateOf(kind, mask.data()[i], d);
      if (states.data()[i] == PixelState::kClue && d < 0) d = -d;
    }
  });
  return states;
}

// stereo/depth_maps/a/b.jpg.measured.bin -> stereo/filled_masks/a/b.jpg.measured.png; empty for other kinds and folders.
fs::path MaskBeside(const fs::path& depth_path) {
  if (!depth_path.string().ends_with("." + std::string(kMeasured) + ".bin")) return {};
  fs::path below, folder = fs::absolute(depth_path).lexically_normal();
  while (folder.has_relative_path()) {
    below = below.empty() ? folder.filename() : folder.filename() / below;
    folder = folder.parent_path();
    if (folder.filename() == "depth_maps") {
      return (folder.parent_path() / "filled_masks" / below).replace_extension(".png");
    }
  }
  return {};
}

DepthRows ReadPublishedRows(const fs::path& depth_path, int max_rows) {
  DepthRows rows = ReadDepthRows(depth_path, max_rows);
  const fs::path mask_path = MaskBeside(depth_path);
  if (mask_path.empty() || !fs::exists(mask_path)) return rows;
  const phi::Mask mask = ReadMask(mask_path);
  phi::DepthMap& depths = rows.depths;
  const auto width = static_cast<std::size_t>(depths.width());
  for (int y = 0; y < depths.height(); ++y) {
    const std::size_t row = static_cast<std::size_t>(NearestPixel(y, depths.height(), rows.map_height)) * width;
    for (std::size_t x = 0; x < width && row + x < mask.size(); ++x) {
      if (mask.data()[row + x] == kClueValue) depths(static_cast<int>(x), y) = 0;
    }
  }
  return rows;
}

}  // namespace

phi::Mask MaskOfStates(const phi::StateMap& states) {
  return phi::Transformed(states, [](phi::PixelState s) { return ValueOf(s); });
}

bool HasMap(const Workspace& workspace, int image, std::string_view kind) {
  std::error_code unreachable;
  return fs::exists(workspace.DepthMapPath(image, kind), unreachable) ||
         fs::exists(CompactMapPath(workspace, image, kind), unreachable);
}

phi::MeasurementMap ReadMeasurements(const Workspace& workspace, int image, std::string_view kind) {
  if (const fs::path compact = CompactMapPath(workspace, image, kind); fs::exists(compact)) return ReadCompactMap(compact);
  phi::MeasurementMap map{
      ReadPlaneMap(workspace.DepthMapPath(image, kind), workspace.NormalMapPath(image, kind)), {}};
  if (!HasStates(kind)) return map;
  const auto depth = [&](std::size_t i) -> float& { return map.planes.data()[i].depth; };
  map.states = ReadStates(workspace, image, kind, map.width(), map.height(), depth);
  return map;
}

phi::MeasuredDepths ReadMeasuredDepths(const Workspace& workspace, int image, std::string_view kind) {
  if (fs::exists(CompactMapPath(workspace, image, kind))) return phi::DepthsOf(ReadMeasurements(workspace, image, kind));
  phi::MeasuredDepths map{ReadDepthMap(workspace.DepthMapPath(image, kind)), {}};
  if (!HasStates(kind)) return map;
  const auto depth = [&](std::size_t i) -> float& { return map.depths.data()[i]; };
  map.states = ReadStates(workspace, image, kind, map.width(), map.height(), depth);
  return map;
}

phi::DepthMap ReadPublishedDepths(const fs::path& depth_path) { return ReadPublishedRows(depth_path, kAllRows).depths; }

std::optional<DepthRows> FindPublishedDepths(const Workspace& workspace, int image, std::string_view kind, int max_rows) {
  if (const fs::path compact = CompactMapPath(workspace, image, kind); fs::exists(compact)) return ReadCompactDepthRows(compact, max_rows);
  const fs::path depth_path = workspace.DepthMapPath(image, kind);
  if (!fs::exists(depth_path)) return std::nullopt;
  return ReadPublishedRows(depth_path, max_rows);
}

}  // namespace colmap_ext

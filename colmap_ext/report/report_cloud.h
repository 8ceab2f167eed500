// The part of the cloud that the report shows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "colmap_ext/workspace.h"

namespace colmap_ext {

// A random choice of a cloud's points, in the order of the file.
struct CloudSample {
  struct Point {
    std::array<double, 3> xyz{};  // from the cloud's offset, world units
    std::array<float, 3> normal{};
    std::array<std::uint8_t, 3> rgb{160, 160, 160};
    bool inferred = false;
    std::uint8_t confidence = 0;  // per cent; 0: not judged
    std::uint8_t error = 255;         // to truth, over depth, in units of kErrorUnit; 254: that or more; 255: not known
    std::vector<std::uint16_t> views;  // images that see it, as indices into the workspace's views
  };
  static constexpr double kErrorUnit = 0.05 / 254;

  std::uint64_t num_points = 0;           // of the file
  std::array<double, 3> offset{0, 0, 0};  // of the points from the world's origin, as the file's header says; world units
  std::vector<Point> points;
  bool has_normals = false, has_origin = false;  // properties of the file
};

// Of all files that a cloud is written in, as their headers say.
struct CloudCount {
  std::uint64_t num_points = 0;
  std::size_t num_files = 1;
};
CloudCount CountCloud(const std::filesystem::path& ply, std::uint64_t num_points_of_first);

// At most max_points, each point of the file as likely as any other; the same for the same file. Views are read from the
// .vis file beside it, where there is one for as many points. Throws phi::InputError for a damaged file.
CloudSample SampleCloud(const std::filesystem::path& ply, int max_points);

// Sets the points' errors: the difference in depth to the truth in the first image that sees the point and has truth
// there. truth: by image name, as FindTruthMaps.
void CompareWithTruth(const Workspace& workspace, const std::map<std::string, std::filesystem::path>& truth,
                      double values_per_unit, CloudSample* sample);

// What the page draws, without the points far outside the bulk, so that a few strays do not shrink the view.
// Coordinates are 16-bit, x = center + scale * value / 32767.
struct ReportCloud {
  std::size_t num_shown = 0;
  double center[3] = {0, 0, 0};
  double scale = 1;
  // base64 of little-endian values: int16 x y z; uint8 r g b; int8 x y z; uint8; uint8, per cent; uint8; number of views, uint8 (255:
  // that or more); views of all points, one after the other, at most 255 each, uint16.
  // All from the normals on may be empty.
  std::string positions, colors, normals, inferred, confidences, errors, view_counts, views;
};

ReportCloud PackCloud(const CloudSample& sample);

}  // namespace colmap_ext

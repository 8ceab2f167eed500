// Clouds for the evaluator: a reconstruction, and the truth as a cloud, a mesh or a MeshLab project of laser
// scans.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "colmap_ext/evaluation/cloud_evaluation.h"
#include "colmap_ext/evaluation/crop_volume.h"

namespace colmap_ext {

struct TruthOptions {
  std::filesystem::path path;  // --truth_path: .ply (cloud or mesh) or .mlp (scans with their poses)
  int min_views = 0;  // --min_truth_views: leaves out points whose property `views` is lower; 0 = off
  double mesh_spacing = 0.002;                // --mesh_sample_spacing: between samples of a mesh, world units
  std::size_t memory = std::size_t{8} << 30;  // --memory, bytes: of both clouds
  std::vector<Eigen::Vector3d> scanners;      // --scanner_position of the one scan in `path`, world frame
  BeamOptions beams;
};

// What Tanks and Temples does with the clouds before it compares them.
struct CloudPreparation {
  std::optional<Eigen::Matrix4d> truth_from_cloud;  // --cloud_transform_path: a similarity
  std::optional<CropVolume> crop;  // --crop_volume_path: in the truth's frame, for both clouds
  // --thin_clouds: the points of a voxel become their mean. Averages over the same voxels are then the plain shares of
  // the points that are left.
  bool thin = false;
};

struct LoadedClouds {
  Eigen::Vector3d origin{0, 0, 0};  // world position of the clouds' (0, 0, 0)
  CloudPair clouds;
};

// World positions: the offset that a header names (PlyRows) is added. Points that are not finite and triangles with such a corner
// are left out. `voxel_size`: the origin is a whole number of voxels, so that moving it does not move the grid. `inferred_apart`:
// also reads which points of the cloud were inferred. Throws phi::InputError when a file is damaged, holds no point or does not
// tell what was inferred, and phi::ResourceError when the clouds need more memory than they may have.
LoadedClouds LoadClouds(const std::filesystem::path& cloud_path, const TruthOptions& truth, double voxel_size,
                        bool inferred_apart = false, const CloudPreparation& preparation = {});

// Samples of triangle (a, b, c), at most `spacing` apart along both edges from a; corners included.
void SampleTriangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    double spacing, const std::function<void(const Eigen::Vector3d&)>& on_sample);
// As many at least.
double NumTriangleSamples(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                          double spacing);

}  // namespace colmap_ext

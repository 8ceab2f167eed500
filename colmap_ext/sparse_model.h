// COLMAP's sparse models: cameras, images and points3D as .bin (preferred) or .txt, COLMAP 3.8 to 4.x.
// rigs.* and frames.* (COLMAP 3.12 and later) may be present and are not needed: poses in images.* suffice.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "colmap_ext/problem_list.h"

namespace colmap_ext {

class AtomicFile;

inline constexpr std::uint64_t kInvalidPoint3D = ~std::uint64_t{0};

struct SparseCamera {
  std::uint32_t camera_id = 0;
  int model_id = 1;  // COLMAP's number; 0 = SIMPLE_PINHOLE, 1 = PINHOLE
  std::uint64_t width = 0, height = 0;
  std::vector<double> params;  // COLMAP's order
};

struct Observation {
  double x = 0, y = 0;  // pixels, K's coordinates
  std::uint64_t point3D_id = kInvalidPoint3D;
};

struct SparseImage {
  std::uint32_t image_id = 0;
  Eigen::Quaterniond rotation{1, 0, 0, 0};  // cam_from_world
  Eigen::Vector3d translation{0, 0, 0};     // cam_from_world
  std::uint32_t camera_id = 0;
  std::string name;  // relative to images/, UTF-8
  std::vector<Observation> observations;
};

struct TrackElement {
  std::uint32_t image_id = 0, observation_index = 0;
};

struct SparsePoint {
  std::uint64_t point3D_id = 0;
  Eigen::Vector3d xyz{0, 0, 0};
  std::array<std::uint8_t, 3> rgb{};
  double error = -1;  // mean reprojection error, pixels of the model's images; < 0 = unknown
  std::vector<TrackElement> track;
};

struct SparseModel {
  std::map<std::uint32_t, SparseCamera> cameras;  // by camera_id
  std::vector<SparseImage> images;  // in the file's order: this order is the image index of .vis files
  std::vector<SparsePoint> points;  // in the file's order
};

// The name of COLMAP's camera model, or "unknown camera model N".
std::string CameraModelName(int model_id);

// Throws phi::InputError naming the file and the byte (.bin) or line (.txt) at fault. With `problems`, what
// can be stepped over (a camera without size, an image whose camera is missing) is left out of the model and
// listed instead.
SparseModel ReadSparseModel(const std::filesystem::path& folder, ProblemList* problems = nullptr);

// What is there of the files cameras, images and points3D with the suffix, ".bin" or ".txt", but of the points the first alone: for who
// asks whose model it is. Throws as ReadSparseModel.
SparseModel ReadModelHead(const std::filesystem::path& folder, const std::string& suffix);

// Of the model in the folder, the file that holds the cameras.
std::filesystem::path CamerasFile(const std::filesystem::path& folder);

// Both make three files. COLMAP's rigs and frames of another model in their place go, since COLMAP would take its poses from
// those. Throw phi::Error when they cannot be written, and then an earlier model is whole.
void WriteSparseModelBinary(const SparseModel& model, const std::filesystem::path& folder);
void WriteSparseModelText(const SparseModel& model, const std::filesystem::path& folder);

// The same with points that the caller has written to their file in place of the model's; it gets its name with the others.
void WriteViewsBinary(const SparseModel& model, const std::filesystem::path& folder, AtomicFile* points);
void WriteViewsText(const SparseModel& model, const std::filesystem::path& folder, AtomicFile* points);

}  // namespace colmap_ext

// Internal to the sparse model's readers and writers: puts records together and checks each against those before it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/problem_list.h"
#include "colmap_ext/sparse_model.h"

namespace colmap_ext {

// Where a record begins.
struct ModelPosition {
  const std::filesystem::path* file = nullptr;
  const char* unit = "byte";  // or "line"
  std::uint64_t number = 0;

  phi::Message Text() const;
};

// Gives a model's files their names, in this order, once the disk has all of them. COLMAP's rigs and frames of another model in
// their place go first. suffix: ".bin" or ".txt".
void PublishModel(const std::filesystem::path& folder, const std::string& suffix, const std::array<AtomicFile*, 3>& files);

// Number of parameters of COLMAP's camera models; nothing for unknown ones.
std::optional<std::size_t> NumCameraParams(int model_id);
std::optional<int> CameraModelIdFromName(std::string_view name);

class SparseModelBuilder {
 public:
  explicit SparseModelBuilder(ProblemList* problems) : problems_(problems) {}

  // In this order: all cameras, all images, all points.
  void AddCamera(SparseCamera camera, const ModelPosition& position);
  void AddImage(SparseImage image, const ModelPosition& position);
  void AddPoint(SparsePoint point, const ModelPosition& position);
  void ReserveImages(std::size_t count) { model_.images.reserve(count); }
  void ReservePoints(std::size_t count) { model_.points.reserve(count); }
  void Report(const ModelPosition& position, const phi::Message& message);

  // Reports points whose tracks fit nothing, in a sentence for each image. Warns of what was left out without being a problem.
  SparseModel Finish();

 private:
  std::string ImageProblem(const SparseImage& image) const;
  // The first that names no image or observation of the model; null: there is none.
  const TrackElement* FindWrongElement(const SparsePoint& point) const;

  // Points whose track names the same image wrongly.
  struct WrongPoints {
    std::uint64_t count = 0;
    std::uint64_t point3D_id = 0;         // of the first
    std::uint32_t observation_index = 0;  // that its track names
    phi::Message position = {};           // of its record
  };
  phi::Message Describe(std::uint32_t image_id, const WrongPoints& points) const;

  ProblemList* problems_;
  SparseModel model_;
  std::unordered_map<std::uint32_t, std::size_t> num_observations_;  // by image id
  std::unordered_set<std::uint32_t> dropped_images_;                 // reported already: their tracks are not
  std::map<std::uint32_t, WrongPoints> wrong_points_;                // by image id
  std::uint64_t num_points_nowhere_ = 0;                             // whose position is not finite
  std::string first_point_nowhere_;                                  // where its record is
};

// How much is read of a model.
enum class ModelPart {
  kAll,   // its three files
  kHead,  // those that are there, and of the points the first
};
SparseModel ReadSparseModelBinary(const std::filesystem::path& folder, ProblemList* problems, ModelPart part = ModelPart::kAll);
SparseModel ReadSparseModelText(const std::filesystem::path& folder, ProblemList* problems, ModelPart part = ModelPart::kAll);

}  // namespace colmap_ext

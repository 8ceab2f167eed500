// An undistorted COLMAP workspace: images/, sparse/, stereo/.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "colmap_ext/image_file.h"
#include "colmap_ext/problem_list.h"
#include "colmap_ext/sparse_model.h"
#include "phi/base/image_mask.h"
#include "phi/base/option.h"
#include "phi/geometry/image_correction.h"
#include "phi/scene_view.h"

namespace colmap_ext {

// The kinds of map a workspace holds (the file names' middle part).
inline constexpr std::string_view kPhotometric = "photometric";
inline constexpr std::string_view kMeasured = "measured";
inline constexpr std::string_view kGeometric = "geometric";
inline constexpr std::string_view kRaw = "raw";  // between stages only: estimates whose name the filtered maps take
inline constexpr std::string_view kShared =
    "shared";  // between stages only: estimates with hypotheses of other images, before the first filter
inline constexpr std::string_view kInferred =
    "inferred";  // between stages only: what inference made, before the last filter

struct WorkspaceOptions {
  std::filesystem::path path;
  std::string format = "COLMAP";         // PMVS is refused in one sentence
  int max_image_size = -1;               // longest side of the working resolution, pixels; <= 0 = full
  std::filesystem::path mask_path = {};  // folder of <image name>.png, 0 = leave out; empty: none

  // path and format.
  phi::OptionList FolderList();
  // All, as the stereo names them.
  phi::OptionList List();
};

// A photo in memory, of its camera's size. The pose is used as it is; the model's quaternion would round it.
struct MemoryImage {
  phi::Pose pose;
  std::shared_ptr<const phi::GrayImage> gray;
  std::shared_ptr<const ColorImage> color = {};     // null: gray
  std::shared_ptr<const phi::ImageMask> mask = {};  // null: all of it is used
};

// Reads the sparse model at construction; images and maps on request. Safe for concurrent const calls.
class Workspace {
 public:
  // Throws phi::InputError at the first problem, or lists what can be stepped over: `problems`, if not null.
  // Views whose camera is at fault have a camera of size 0 then.
  explicit Workspace(const WorkspaceOptions& options, ProblemList* problems = nullptr);
  // Without a folder: `images` are parallel to model.images. None of its paths exists. Throws phi::InputError for cameras
  // or names that a workspace may not have, and for images that are not of their camera's size.
  Workspace(SparseModel model, std::vector<MemoryImage> images, int max_image_size);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path StereoFolder() const { return path_ / "stereo"; }
  const SparseModel& model() const { return model_; }
  // Gives up the memory of the model's observations, of which COLMAP keeps those of no point too: for who needs them no more.
  void DropObservations();
  // Parallel to model().images: names, ids and cameras at the working resolution.
  const std::vector<phi::SceneView>& views() const { return views_; }
  int FindImage(std::string_view name) const;  // index, or -1
  std::int64_t LargestImage() const;           // pixels, of the views

  // From here on gray photos are moved to where their points are. corrections: by view, or empty.
  void SetCorrections(std::vector<phi::ImageCorrection> corrections) { corrections_ = std::move(corrections); }
  // Null: the photo is used as it is.
  const phi::ImageCorrection* Correction(int image) const { return corrections_.empty() ? nullptr : &corrections_[image]; }

  const std::filesystem::path& mask_path() const { return mask_path_; }  // empty: no masks
  std::filesystem::path ImagePath(int image) const;
  std::filesystem::path DepthMapPath(int image, std::string_view kind) const;
  std::filesystem::path NormalMapPath(int image, std::string_view kind) const;
  std::filesystem::path CostMapPath(int image, std::string_view kind) const;
  std::filesystem::path ConfidenceMapsFolder() const { return StereoFolder() / "confidence_maps"; }
  std::filesystem::path ConfidenceMapPath(int image, std::string_view kind) const;
  std::filesystem::path FilledMaskPath(int image) const;
  // Of what goes with a map that is not the geometric one, beside it.
  std::filesystem::path FilledMaskPath(int image, std::string_view kind) const;
  bool IsInMemory() const { return !memory_images_.empty(); }
  bool HasImageMask(int image) const;
  // Of --PhiStereo.mask_path, whether it is there or not; empty without a folder of masks.
  std::filesystem::path ImageMaskPath(int image) const;
  // The image's in a folder of masks, as COLMAP names them.
  std::filesystem::path MaskPathIn(const std::filesystem::path& folder, int image) const;

  // The photo's file, for those who want it in gray and in colour. Not of a workspace in memory. Throws phi::InputError
  // naming the file when it is missing or cannot be read.
  std::shared_ptr<const PhotoFile> ReadPhoto(int image) const;
  // 8-bit gray at the working resolution, moved by its correction; of the photo's file where it is given. Throws phi::InputError
  // naming the file when it is missing, damaged, or its size disagrees with its camera.
  std::shared_ptr<const phi::GrayImage> ReadGray(int image, const PhotoFile* photo = nullptr) const;
  // The image's mask at the working resolution: a pixel that covers any masked one is masked. Null where there is none.
  // Throws phi::InputError when it is damaged or has not the image's size.
  std::shared_ptr<const phi::ImageMask> ReadImageMask(int image) const;
  // Colours for a map of width x height pixels, whatever the working resolution. Throws as ReadGray.
  ColorImage ReadColor(int image, int width, int height, const PhotoFile* photo = nullptr) const;

 private:
  // The image at its camera's full size. photo: may be null.
  template <typename Image>
  Image ReadFullSize(int image, const PhotoFile* photo, Image (*decode)(const PhotoFile&, const CheckSize&)) const;

  std::shared_ptr<const phi::GrayImage> ReadUnmovedGray(int image, const PhotoFile* photo) const;

  // What errors name.
  struct Origin {
    phi::Message model, cameras;
  };
  // Fills views_ from model_.
  void MakeViews(const Origin& origin, int max_image_size, ProblemList* problems);

  std::filesystem::path path_, mask_path_;
  std::vector<MemoryImage> memory_images_;  // empty, or parallel to model_.images
  std::vector<phi::ImageCorrection> corrections_;  // by view, or empty
  SparseModel model_;
  std::vector<phi::SceneView> views_;
  std::unordered_map<std::string, int> index_by_name_;
};

}  // namespace colmap_ext

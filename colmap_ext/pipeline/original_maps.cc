#include "colmap_ext/pipeline/original_maps.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/pipeline/file_identity.h"
#include "colmap_ext/pipeline/result_files.h"
#include "colmap_ext/pipeline/run_record.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kOriginal = "original";

// A second name for the file's content; a copy on a file system that knows no such thing.
void GiveSecondName(const fs::path& from, const fs::path& to) {
  fs::remove(to);
  std::error_code cannot;
  fs::create_hard_link(from, to, cannot);
  if (cannot) fs::copy_file(from, to);
}

void GiveSecondName(const Workspace& workspace, int image, std::string_view to) {
  GiveSecondName(workspace.DepthMapPath(image, kGeometric), workspace.DepthMapPath(image, to));
  GiveSecondName(workspace.NormalMapPath(image, kGeometric), workspace.NormalMapPath(image, to));
}

// Its geometric map is a filling, and nobody has replaced it since, of maps that the record does not know.
bool IsFilledForeign(const Workspace& workspace, const RunRecord& record, int image) {
  const std::string& name = workspace.views()[image].name;
  const auto geometric = record.Find(name, std::string(kGeometric));
  return geometric && geometric->key.starts_with(kFillingKey) &&
         !record.Find(name, std::string(kMeasured)) &&
         IsOneOf(workspace.DepthMapPath(image, kGeometric), geometric->files);
}

bool IsNoPlane(const phi::PlaneHypothesis& h) {
  const float normal = h.normal.x + h.normal.y + h.normal.z;
  return h.depth < 0 || !std::isfinite(h.depth) || !std::isfinite(normal);
}

void RemoveMaps(const Workspace& workspace, int image, std::string_view kind) {
  fs::remove(workspace.DepthMapPath(image, kind));
  fs::remove(workspace.NormalMapPath(image, kind));
}

// The depth map decides whose an image is (IsFilledForeign) and comes last: after a kill at any point, the same again does
// the rest. False where what was kept is no longer there.
bool PutBack(const Workspace& workspace, const RunRecord& record, int image, ConfidenceRemoval* confidence) {
  const bool differed = fs::exists(workspace.DepthMapPath(image, kOriginal));
  const std::string_view kept = differed ? kOriginal : kMeasured;
  if (!fs::exists(workspace.DepthMapPath(image, kept))) return false;
  const fs::path normals = workspace.NormalMapPath(image, kGeometric);
  if (fs::exists(workspace.NormalMapPath(image, kept))) {
    fs::rename(workspace.NormalMapPath(image, kept), normals);
  } else if (IsOneOf(normals, record.Find(workspace.views()[image].name, std::string(kGeometric))->files)) {
    return false;
  }
  if (differed) RemoveMaps(workspace, image, kMeasured);
  fs::remove(workspace.FilledMaskPath(image));
  fs::remove(workspace.FilledMaskPath(image, kMeasured));
  confidence->Remove(std::string(kGeometric));  // of the filled map
  fs::rename(workspace.DepthMapPath(image, kept), workspace.DepthMapPath(image, kGeometric));
  return true;
}

}  // namespace

void KeepOriginalMaps(const Workspace& workspace, int image) {
  fs::remove(CompactMapPath(workspace, image, kMeasured));  // of maps that these replaced
  phi::PlaneMap map =
      ReadPlaneMap(workspace.DepthMapPath(image, kGeometric), workspace.NormalMapPath(image, kGeometric));
  if (std::none_of(map.begin(), map.end(), IsNoPlane)) {
    GiveSecondName(workspace, image, kMeasured);
    RemoveMaps(workspace, image, kOriginal);  // of maps that these replaced
    return;
  }
  // A negative depth is none there; in ours it would be an earlier version's clue. Numbers that are not finite would be published.
  GiveSecondName(workspace, image, kOriginal);
  std::replace_if(map.begin(), map.end(), IsNoPlane, phi::PlaneHypothesis{});
  WritePlaneMap(workspace.DepthMapPath(image, kMeasured), workspace.NormalMapPath(image, kMeasured), map);
}

int RestoreOriginalMaps(const Workspace& workspace, const std::vector<ImageJob>& jobs) {
  RunRecord record(workspace.StereoFolder());
  ConfidenceRemoval confidence(workspace);
  int num_restored = 0;
  for (const ImageJob& job : jobs) {
    const std::string& name = workspace.views()[job.image].name;
    if (!IsFilledForeign(workspace, record, job.image) || !PutBack(workspace, record, job.image, &confidence)) continue;
    record.Forget({name, std::string(kGeometric)});
    ++num_restored;
  }
  if (num_restored == 0) {
    throw phi::InputError(phi::AboutFile(workspace.StereoFolder()) +
                          " holds no maps of another program that hole_filler filled: there is nothing to "
                          "put back. Of phimvs's own maps, --PhiInference.mode off takes the filled depths "
                          "out again");
  }
  record.Compact();
  return num_restored;
}

}  // namespace colmap_ext

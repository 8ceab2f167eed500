#include "colmap_ext/pipeline/stale_maps.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include <tbb/parallel_for.h>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/pipeline/file_identity.h"
#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

// Some of the images, by their number and the first one's name.
struct Images {
  int count = 0;
  std::string first = {};

  void Add(const std::string& name) {
    if (count++ == 0) first = name;
  }
};

// Those of which the last run could not make these maps, or what they are made of: a shard notes nothing of the stages after that.
std::set<std::string> FailedImages(const RunRecord& record, std::string_view kind) {
  constexpr std::string_view kChain[] = {kRaw, kPhotometric, kShared, kMeasured, kInferred, kGeometric};
  const auto end = std::find(std::begin(kChain), std::end(kChain), kind);
  std::set<std::string> images;
  for (const auto& [task, known] : record.Tasks()) {
    const bool matters = task.second == kind || std::find(std::begin(kChain), end, task.second) != end;
    if (matters && known.state == "failed" && known.options_hash == record.options_hash()) images.insert(task.first);
  }
  return images;
}

// Whose work a map is. kOlder: of other options than the last run's.
enum class Origin { kNoMap, kForeign, kFailed, kUnfinished, kOlder, kLastRun };

Origin OriginOf(const Workspace& workspace, int image, std::string_view kind, const RunRecord& record,
                const std::set<std::string>& failed_images) {
  const std::filesystem::path compact = CompactMapPath(workspace, image, kind);
  const std::filesystem::path path = std::filesystem::exists(compact) ? compact : workspace.DepthMapPath(image, kind);
  if (!std::filesystem::exists(path)) return Origin::kNoMap;
  const std::string& name = workspace.views()[static_cast<std::size_t>(image)].name;
  const auto task = record.Find(name, std::string(kind));
  if (!task || (task->state == "done" && !task->files.empty() && !IsOneOf(path, task->files))) return Origin::kForeign;
  if (failed_images.contains(name)) return Origin::kFailed;
  if (task->state != "done") return Origin::kUnfinished;
  return task->IsOfOptions(record.options_hash()) ? Origin::kLastRun : Origin::kOlder;
}

}  // namespace

std::vector<std::string> DescribeStaleMaps(const Workspace& workspace, std::string_view kind) {
  std::optional<RunRecord> known;
  try {
    known.emplace(workspace.StereoFolder());
  } catch (const phi::InputError& error) {
    return {std::string("whether one run made all the maps is not known: ") + error.what()};
  }
  const RunRecord& record = *known;
  if (record.Tasks().empty()) return {};
  const std::set<std::string> failed_images = FailedImages(record, kind);
  std::vector<Origin> origins(workspace.views().size());
  // Side by side: a shared disk takes half a millisecond to answer.
  tbb::parallel_for(std::size_t{0}, origins.size(), [&](std::size_t i) {
    origins[i] = OriginOf(workspace, static_cast<int>(i), kind, record, failed_images);
  });
  std::map<Origin, Images> of_origin;
  for (std::size_t i = 0; i < origins.size(); ++i) of_origin[origins[i]].Add(workspace.views()[i].name);
  const int num_maps = static_cast<int>(origins.size()) - of_origin[Origin::kNoMap].count;
  std::vector<std::string> sentences;
  const auto tell = [&](Origin origin, const std::string& what) {
    const Images& images = of_origin[origin];
    if (images.count == 0) return;
    sentences.push_back(std::to_string(images.count) + " of " + std::to_string(num_maps) + " " +
                        std::string(kind) + " maps, " + images.first + " the first, " + what);
  };
  tell(Origin::kForeign, "were not made by phimvs, the others were");
  tell(Origin::kFailed, "are of an earlier run, since their images failed in the last one; `phimvs status` says why");
  const bool is_at_work = FindLockUse(workspace.StereoFolder()) == LockUse::kHeld;
  tell(Origin::kUnfinished, is_at_work ? "are to be made again by a run that is at work; fuse again when it is done"
                              : "were to be made again by a run that stopped; run patch_match_stereo again");
  tell(Origin::kOlder,
       "were made with other options than those of the last run, which left them as they were; run "
       "patch_match_stereo again with the options that you want, or choose another --input_type");
  return sentences;
}

}  // namespace colmap_ext

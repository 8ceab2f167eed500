#include "colmap_ext/pipeline/stale_maps.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
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
  const std::size_t num_views = workspace.views().size();
  std::vector<char> exists(num_views), is_foreign(num_views);
  // Side by side: a shared disk takes half a millisecond to answer.
  tbb::parallel_for(std::size_t{0}, num_views, [&](std::size_t i) {
    const std::filesystem::path compact = CompactMapPath(workspace, static_cast<int>(i), kind);
    const std::filesystem::path path =
        std::filesystem::exists(compact) ? compact : workspace.DepthMapPath(static_cast<int>(i), kind);
    if (!(exists[i] = std::filesystem::exists(path))) return;
    const auto task = record.Find(workspace.views()[i].name, std::string(kind));
    is_foreign[i] = !task || (task->state == "done" && !task->files.empty() && !IsOneOf(path, task->files));
  });
  Images foreign, failed, unfinished, older;
  int num_maps = 0;
  for (std::size_t i = 0; i < num_views; ++i) {
    if (!exists[i]) continue;
    ++num_maps;
    const std::string& name = workspace.views()[i].name;
    const auto task = record.Find(name, std::string(kind));
    if (is_foreign[i]) {
      foreign.Add(name);
    } else if (failed_images.contains(name)) {
      failed.Add(name);
    } else if (task->state != "done") {
      unfinished.Add(name);
    } else if (!task->IsOfOptions(record.options_hash())) {
      older.Add(name);
    }
  }
  std::vector<std::string> sentences;
  const auto tell = [&](const Images& images, const std::string& what) {
    if (images.count == 0) return;
    sentences.push_back(std::to_string(images.count) + " of " + std::to_string(num_maps) + " " +
                        std::string(kind) + " maps, " + images.first + " the first, " + what);
  };
  tell(foreign, "were not made by phimvs, the others were");
  tell(failed, "are of an earlier run, since their images failed in the last one; `phimvs status` says why");
  const bool is_at_work = FindLockUse(workspace.StereoFolder()) == LockUse::kHeld;
  tell(unfinished, is_at_work ? "are to be made again by a run that is at work; fuse again when it is done"
                              : "were to be made again by a run that stopped; run patch_match_stereo again");
  tell(older,
       "were made with other options than those of the last run, which left them as they were; run "
       "patch_match_stereo again with the options that you want, or choose another --input_type");
  return sentences;
}

}  // namespace colmap_ext
